// porthos verify, info and compare of spacecraft in orbit: axioms at the orbit's own size, forces
// that act in the split only.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/compare/compare.h"
#include "scene/run/verdict.h"
#include "scene/session/info.h"
#include "tests/run/scenes.h"

namespace porthos::scene::verify_orbit_test {
namespace {

using test::says;

const char* const orbit = "[orbit]\naltitude = 450e3\ninclination = 0.9\n";
const char* const drag =
    "drag = { density = 1e-12, altitude = 450e3, scale_height = 60e3, area_coefficient = 9.0 }\n";

struct Place {
  test::TemporaryFolder folder;
  Scene scene(const std::string& middle, const std::string& verify = "") const {
    test::write_bytes(folder / "m.urdf", test::arm_urdf());
    test::write_bytes(
        folder / "s.toml",
        "[model]\nurdf = 'm.urdf'\nbase = 'free'\n[initial]\nbase = { angular_velocity = [0, 0.01, "
        "0.02] }\njoints.elbow = { velocity = 0.05 }\n[planet]\nrotation_rate = 7.29e-5\n" +
            middle + "[integrator]\nmethod = 'gauss8'\nstep = 5.0\n[run]\nduration = 1000.0\n" +
            verify);
    return read_scene((folder / "s.toml").string());
  }
  RunReport verify(const Scene& s) const {
    auto o = test::into(folder / "out");
    o.check_symmetry = true;
    return run(s, assemble(s), o);
  }
};
const Check* find(const RunReport& r, const std::string& name) {
  for (const auto& c : r.checks)
    if (c.name == name) return &c;
  return nullptr;
}
std::string why_not(const RunReport& r, const std::string& name) {
  for (const auto& n : r.not_applicable)
    if (n.name == name) return n.why;
  return "";
}

TEST(VerifyOrbit, HoldsWithTheDefaultLimits) {
  const Place place;
  const Scene s = place.scene(orbit);
  const auto r = place.verify(s);
  for (const auto& c : r.checks)
    EXPECT_TRUE(c.pass) << c.name << " " << c.value << " > " << c.limit;
  for (const char* name : {"energy", "angular_momentum (less impulses)", "orbital", "coupling",
                           "axiom: field", "axiom: power balance", "symmetry"})
    EXPECT_TRUE(find(r, name)) << name;
  EXPECT_EQ(r.verdict(), Verdict::pass);
  // An axiom that is compared with the size of the orbit could not fail: rounding stands where it
  // should.
  std::printf("  power balance %.1e, field %.1e (1e-11)\n", find(r, "axiom: power balance")->value,
              find(r, "axiom: field")->value);
  EXPECT_GT(find(r, "axiom: power balance")->value, 1e-20);
  // Control: the balance sees the power of the gradient. Without it the axiom would fail by far.
  const Assembly a = assemble(s);
  const auto& powers = a.model->description().powers;
  const auto f = a.model->instantiate<double>();
  std::vector<double> e(a.initial.x.size()), dx(e.size()), w(powers.size());
  f->gradient(a.initial.x, e);
  f->field(0, a.initial.x, {}, dx);
  f->powers(0, a.initial.x, e, w);
  double effort = 0, rate = 0, power = 0;
  for (size_t i = 0; i < a.spacecraft->internal_size(); ++i) {
    effort = std::hypot(effort, e[i]);
    rate = std::hypot(rate, dx[i]);
  }
  for (size_t i = 0; i < w.size(); ++i)
    if (powers[i].name == "gravity_gradient") power = std::fabs(w[i]);
  std::printf("  power of the gradient %.1e of the terms compared\n", power / (effort * rate));
  EXPECT_GT(power, 1e-9 * effort * rate);
}

TEST(VerifyOrbit, ForcesOfTheSplitAreNotApplicableAndTheRestIs) {
  const Place place;
  const Scene s = place.scene(orbit + std::string(drag));
  const auto r = place.verify(s);
  EXPECT_EQ(r.verdict(), Verdict::pass);
  for (const char* name : {"axiom: field", "axiom: power balance", "axiom: efforts"})
    EXPECT_TRUE(says(why_not(r, name), "act in the split of orbit and internal motion only"));
  ASSERT_TRUE(find(r, "axiom: field (internal motion)"));
  EXPECT_TRUE(find(r, "axiom: J skew"));
  EXPECT_TRUE(says(why_not(r, "symmetry"), "backwards in time they would drive"));
  for (const char* file : {"summary.json", "run.h5"})
    EXPECT_TRUE(test::fs::exists(place.folder / "out" / file)) << file;
}

TEST(VerifyOrbit, InfoAndCompareTakeForcesOfTheSplit) {
  const Place place;
  const Scene s = place.scene(orbit + std::string(drag));
  const Assembly a = assemble(s);
  EXPECT_TRUE(says(info_text(s, a), "Cost of one evaluation of the internal motion"));
  const Comparison c =
      compare(s, a, {.methods = {"gauss8", "gauss16", "rk4"}, .budget_s = 2, .duration = 200.0});
  size_t complete = 0;
  for (const auto& m : c.methods)
    for (const auto& t : m.trials) complete += t.complete();
  EXPECT_GE(complete, 6u);
  ASSERT_TRUE(c.reference) << "two runs that agree";
  std::printf("  %zu trials, reference known to %.1e\n", complete, c.reference->error);
  EXPECT_LT(c.reference->error, 1e-6);
}

}  // namespace
}  // namespace porthos::scene::verify_orbit_test
