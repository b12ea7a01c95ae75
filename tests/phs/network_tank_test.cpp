// Tanks of a network: they pay for laws that make energy, within their bounds and for no more than
// they hold.
#include <gtest/gtest.h>

#include "integrators/catalogue.h"
#include "phs/network/network.h"
#include "phs/system/user_model.h"
#include "tests/support/bounds.h"

namespace porthos::phs::network_tank_test {
namespace {

/// A mass of 2 kg on a spring of 3 N/m: x = (q, p).
struct Mass {
  static Description description() {
    Description r;
    r.name = "mass";
    r.nx = 2;
    r.nu = 1;
    r.blocks = {{"way", BlockKind::linear, 0, 1, 1, "m", "N s"}};
    r.ports = {{"push", PortKind::effort_in, 1, 0, "N", "m/s"}};
    r.traits.canonical = true;
    return r;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[1] * x[1] / T(4.0) + T(1.5) * x[0] * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(3.0) * x[0];
    e[1] = x[1] / T(2.0);
  }
  template <class T>
  void input(std::span<const T>, std::span<const T> u, std::span<T> Gu) const {
    Gu[0] = T(0.0);
    Gu[1] = u[0];
  }
};

/// The same force with a memory: what it gives is its rate, times its gain.
struct Pump final : SampledLaw {
  std::vector<double> fresh() const override { return {}; }
  void operator()(double, std::span<const double>, std::span<const double> y, std::span<double>,
                  std::span<double> u) const override {
    u[0] = 0.8 * y[0];
  }
};

enum class Kind { continuous, sampled, with_memory };
constexpr double least = 0.5, most = 4;

/// A law that makes energy, negative damping, and a damper that gives half of its own back.
std::shared_ptr<const NetworkModel> pumped(Kind kind, const std::string& tank, double damping) {
  Network n("pumped");
  n.add("mass", std::make_shared<UserModel<Mass>>(Mass{})).main("mass");
  n.tank("tank", {least, most});
  if (kind == Kind::with_memory)
    n.control("pump", std::vector<std::string>{"mass.push"}, std::make_shared<Pump>(), 0.1, tank);
  else
    n.control("pump", "mass.push", law([](auto, auto, auto y, auto u) {
                using T = typename decltype(u)::value_type;
                u[0] = T(0.8) * y[0];
              }),
              {.period = kind == Kind::sampled ? 0.1 : 0, .tank = tank});
  if (damping > 0) n.fill("damper", {"mass.push"}, {damping}, 0.5, "tank");
  return n.build();
}

struct Outcome {
  double low = HUGE_VAL, high = 0, rise = 0, defect = 0, mass = 0;
};
Outcome run(const Model& m, const std::string& method, double level, double rate,
            double duration = 20) {
  const auto integrator = integrators::make_integrator(method, m, 0.01);
  const auto system = m.instantiate<double>();
  State s(m.description(), {0.1, 2 * rate, level});
  double before = system->hamiltonian(s.x);
  const double first = before;
  const auto& powers = m.description().powers;
  double booked = 0;
  Outcome o;
  for (int i = 0; i < std::lround(duration / 0.01); ++i) {
    if (integrator->step(s) != integrators::Outcome::ok) throw InvalidArgument("step failed");
    const double now = system->hamiltonian(s.x);
    for (size_t a = 0; a < powers.size(); ++a)
      if (powers[a].kind != PowerKind::observed)
        booked += (powers[a].kind == PowerKind::supplied ? 1 : -1) * integrator->port_work()[a];
    o.rise = std::max(o.rise, now - before);
    o.defect = std::max(o.defect, std::fabs(now - first - booked));
    before = now;
    o.low = std::min(o.low, s.x[2]);
    o.high = std::max(o.high, s.x[2]);
  }
  o.mass = before - s.x[2];
  return o;
}

}  // namespace

TEST(NetworkTank, PaysForALawThatMakesEnergyAndForNoMoreThanItHolds) {
  for (const auto kind : {Kind::continuous, Kind::sampled, Kind::with_memory}) {
    SCOPED_TRACE(int(kind));
    const auto paid = pumped(kind, "tank", 0), free = pumped(kind, "", 0);
    EXPECT_EQ(paid->description().storages, (std::vector<std::string>{"energy", "tank"}));
    EXPECT_TRUE(paid->description().invariants.empty());
    // A method that conserves quadratic invariants: H + E is none, and its error is that of steps.
    const auto o = run(*paid, "gauss8", 3, 1);
    std::printf("  tank %.3f to %.3f J, the mass ends with %.3f J\n", o.low, o.high, o.mass);
    test::keeps("below the lower bound [J]", least - o.low, 0);
    test::keeps("rise of H in a step [J]", o.rise, 1e-13);
    test::keeps("ledger against H [J]", o.defect, 1e-12);
    test::breaks("what the mass gained [J]", o.mass - 1.015, 2);
    // What pays is the tank alone: 1.015 J were there, 2.5 J above the bound.
    test::keeps("more than there was [J]", o.mass - 1.015 - 2.5, 0);
    test::breaks("without the tank [J]", run(*free, "gauss8", 3, 1, 10).rise, 1e-3);
  }
}

TEST(NetworkTank, ADiscreteGradientExchangesEnergyToRounding) {
  // It alters all efforts, that of the tank too: the exchange is skew in them.
  const auto o = run(*pumped(Kind::continuous, "tank", 0.3), "gonzalez", 3, 1);
  test::keeps("rise of H in a step [J]", o.rise, 1e-13);
  test::keeps("ledger against H [J]", o.defect, 1e-12);
}

TEST(NetworkTank, ADamperFillsItToTheUpperBound) {
  const auto o = run(*pumped(Kind::continuous, "", 4), "gauss8", 0.6, 4);
  test::keeps("above the upper bound [J]", o.high - most, 0);
  test::breaks("it was filled [J]", o.high, 3.5);
  const auto half = run(*pumped(Kind::with_memory, "tank", 0.8), "gauss8", least, 2);
  test::breaks("an empty one serves again when it is filled [J]", half.high - least, 0.1);
}

TEST(NetworkTank, RefusesWhatItIsNot) {
  const auto refused = [](auto add) {
    Network n("pumped");
    n.add("mass", std::make_shared<UserModel<Mass>>(Mass{}));
    try {
      add(n);
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto says = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says(refused([](Network& n) { n.tank("tank", {2, 1}); }), "expected 0 <= least < most");
  says(refused([](Network& n) { n.fill("damper", {"mass.push"}, {1}, 0.5, "tank"); }),
       "expected one that was added before");
  says(
      refused([](Network& n) { n.tank("tank", {}).fill("damper", {"mass.push"}, {1}, 2, "tank"); }),
      "expected one in [0, 1]");
  says(refused(
           [](Network& n) { n.tank("tank", {}).fill("damper", {"mass.push"}, {-1}, 0, "tank"); }),
       "expected 0 or more");
}

}  // namespace porthos::phs::network_tank_test
