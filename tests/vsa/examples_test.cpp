// The examples say what their pages say.
#include "integrators/core/integrator.h"
#include "scene/assemble/assembly.h"
#include "tests/places.h"
#include "tests/support/bounds.h"
#include "tests/vsa/actuators.h"

namespace porthos::test::examples_test {
namespace {

std::string example(const std::string& name) {
  return std::string(PORTHOS_SOURCE_DIR) + "/examples/" + name + "/scene.toml";
}

/// Steps through a scene: seen(t, state, works so far).
template <class F>
void play(const std::string& name, F seen) {
  const auto scene = scene::read_scene(example(name));
  const auto a = scene::assemble(scene);
  const auto method = integrators::make_integrator(scene.method, *a.model, scene.step);
  phs::State s = a.initial;
  std::vector<double> works(a.model->description().powers.size());
  const auto steps = std::int64_t(std::lround(scene.duration / scene.step));
  for (std::int64_t i = 0; i < steps; ++i) {
    ASSERT_EQ(method->step(s), integrators::Outcome::ok) << name;
    for (size_t k = 0; k < works.size(); ++k) works[k] += method->port_work()[k];
    seen(a, method->time(s), s, works);
  }
}
double of(const scene::Assembly& a, const std::vector<double>& works, const std::string& power) {
  const auto& p = a.model->description().powers;
  for (size_t k = 0; k < p.size(); ++k)
    if (p[k].name == power) return works[k];
  ADD_FAILURE() << "no power " << power;
  return NAN;
}

TEST(Examples, TheCycleGivesBackWhatItTook) {
  double peak = 0, last = NAN;
  play("vsa_cycle",
       [&](const scene::Assembly& a, double, const phs::State&, const std::vector<double>& w) {
         last = of(a, w, "first.sigma.rate");
         peak = std::max(peak, last);
       });
  EXPECT_NEAR(peak, 0.180776, 0.5e-6);
  keeps("left of two cycles [J]", std::fabs(last), 1e-15);
}

TEST(Examples, TheSpringThrowsFaster) {
  double elastic = 0, rigid = 0, when = 0, paid = 0, motor = 0, deflection = 0;
  play("throwing_arm",
       [&](const scene::Assembly& a, double t, const phs::State& s, const std::vector<double>& w) {
         const auto v =
             a.mechanical->rates(std::span(s.x).first(size_t(a.mechanical->description().nx)));
         rigid = std::max(rigid, v[1]);
         const auto& network = dynamic_cast<const phs::NetworkModel&>(*a.model);
         const size_t at = size_t(network.offset("spring"));
         deflection = std::max(deflection, std::fabs(s.x[at] - s.x[at + 1]));
         if (v[0] <= elastic) return;
         elastic = v[0];
         when = t;
         paid = of(a, w, "spring.sigma.rate");
         motor = of(a, w, "spring.theta.controller");
       });
  std::printf(
      "  peak rates %.2f rad/s (at %.3f s) with, %.2f without the spring; deflection %.2f rad\n",
      elastic, when, rigid, deflection);
  std::printf("  until then %.2f J from the motor, %.2f J through the stiffness port\n", motor,
              paid);
  EXPECT_GT(elastic, 2 * rigid);
  EXPECT_LT(deflection, 1.2) << "the stops are not to be hit";
}

}  // namespace
}  // namespace porthos::test::examples_test
