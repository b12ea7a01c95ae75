// What a user of an installed Porthos writes: the two examples of docs/cpp.md in one file.
#include <cmath>
#include <cstdio>

#include "integrators/core/integrator.h"
#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/check.h"
#include "phs/system/user_model.h"

using namespace porthos;

struct Duffing {  // H = p²/2 - q²/2 + q⁴/4
  phs::Description description() const {
    phs::Description d;
    d.name = "Duffing";
    d.nx = 2;
    d.traits.canonical = true;
    d.blocks = {{.name = "q",
                 .kind = phs::BlockKind::linear,
                 .at = 0,
                 .size = 1,
                 .momentum = 1,
                 .unit = "m",
                 .momentum_unit = "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return 0.5 * x[1] * x[1] + (0.25 * x[0] * x[0] - 0.5) * x[0] * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0] * x[0] * x[0] - x[0];
    e[1] = x[1];
  }
};

int main() {
  mechanics::MechanismBuilder builder("double pendulum");
  for (const char* name : {"upper", "lower"}) {
    mechanics::BodySpec rod;  // hangs along -z, turns about y; inertia xx xy xz yy yz zz
    rod.name = name;
    rod.parent = rod.name == "upper" ? "world" : "upper";
    rod.joint.type = "revolute";
    rod.joint.axis = {0, 1, 0};
    rod.placement.r = {0, 0, rod.name == "upper" ? 0.0 : -1.0};
    rod.mass = {1, {0, 0, -0.5}, {0.0834, 0, 0, 0.0834, 0, 0.0002}};
    builder.add(rod);
  }
  builder.gravity({0, 0, -9.81});
  const mechanics::MechanicalModel model(std::make_shared<mechanics::Mechanism>(builder.build()));
  const std::vector<double> q{2.0, 0.5}, v{0.0, 0.0};
  phs::State state(model.description(), model.state(q, v));
  const auto energy = [&, system = model.instantiate<long double>()] {  // of value + low word
    std::vector<long double> x(state.x.begin(), state.x.end());
    for (size_t i = 0; i < x.size(); ++i) x[i] += state.lo[i];
    return system->hamiltonian(x);
  };
  const auto gauss16 = integrators::make_integrator("gauss16", model, 0.01);
  const long double start = energy();
  for (int i = 0; i < 10000; ++i)
    if (gauss16->step(state) != integrators::Outcome::ok) return 1;
  const double error = double((energy() - start) / start);
  std::printf("H = %.9f J, relative energy error after 100 s: %.1e\n", double(start), error);
  const auto report = phs::check(phs::UserModel(Duffing{}));
  std::fputs(report.text().c_str(), stdout);
  return report.holds() && std::fabs(error) < 1e-13 ? 0 : 1;
}
