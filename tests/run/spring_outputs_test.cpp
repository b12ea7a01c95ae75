// [[output]]s of actuators and their panels of the motion, against closed forms.
#include <fmt/format.h>

#include <cmath>

#include "scene/plot/motion.h"
#include "scene/session/replot.h"
#include "tests/places.h"
#include "tests/run/series.h"
#include "vsa/catalogue.h"
#include "vsa/families.h"

namespace porthos::test::spring_outputs_test {
namespace {

constexpr double a = 6.7328, k = 0.0222;  // of the qbmoves of the example

const std::string outputs = [] {
  std::string all;
  for (const char* of : {"first", "second"})
    for (const char* quantity : {"deflection", "stiffness_setting", "stiffness", "spring_torque"})
      all += fmt::format("[[output]]\nquantity = \"{0}\"\nname = \"{1}_{0}\"\nactuator = \"{1}\"\n",
                         quantity, of);
  return all + "[[output]]\nquantity = \"joint_position\"\nname = \"q\"\njoint = \"loaded\"\n";
}();

/// The example whose qbmoves wind up by sigma = 0.3 (1 - cos t), one of them deflected, for 2 s.
class SpringOutputs : public ::testing::Test {
 protected:
  scene::Scene scene(const std::string& more, const char* start = "0.15") const {
    const auto example = fs::path(PORTHOS_SOURCE_DIR) / "examples" / "vsa_cycle";
    fs::copy_file(example / "links.urdf", folder_ / "links.urdf",
                  fs::copy_options::overwrite_existing);
    std::string text = read_bytes(example / "scene.toml");
    const auto put = [&](const std::string& old, const std::string& now) {
      text.replace(text.find(old), old.size(), now);
    };
    put("duration = 12.566370614359172", "duration = 2");
    put("position = 0.15", std::string("position = ") + start);
    write_bytes(folder_ / "scene.toml", text + "\n" + more);
    return scene::read_scene((folder_ / "scene.toml").string());
  }
  TemporaryFolder folder_;
};

double largest(const std::vector<double>& x, const std::function<double(size_t)>& exact) {
  double most = x.empty() ? HUGE_VAL : 0;
  for (size_t i = 0; i < x.size(); ++i)
    if (const double off = std::fabs(x[i] - exact(i)); !(off <= most)) most = off;
  return most;
}

// σ is integrated by gauss16 in steps of 6 ms: to rounding, 1e-15 of 0.6 rad. The others are of the
// same state: K < 10 N m/rad grows by a K = 70 per rad of σ, and has roundings of 1e-15 of its own.
TEST_F(SpringOutputs, AreThoseOfTheClosedForms) {
  const Series s(scene(outputs));
  const auto t = s("time"), q = s("output/q");
  ASSERT_GT(t.size(), 50u);
  const auto sigma = [&](size_t i) { return 0.3 * (1 - std::cos(t[i])); };
  const auto torque = [&](size_t i) {
    return -2 * k * std::cosh(a * sigma(i)) * std::sinh(a * q[i]);
  };
  const auto stiffness = [&](size_t i) {
    return 2 * a * k * std::cosh(a * sigma(i)) * std::cosh(a * q[i]);
  };
  const auto of = [&](const char* name) { return s(std::string("output/") + name); };
  const auto zero = [](size_t) { return 0.0; };
  for (const char* name : {"first_stiffness_setting", "second_stiffness_setting"})
    keeps(std::string(name) + " [rad]", largest(of(name), sigma), 1e-14);
  keeps("deflection of the one at rest [rad]", largest(of("first_deflection"), zero), 1e-15);
  keeps("its torque [N m]", largest(of("first_spring_torque"), zero), 1e-14);
  keeps(
      "its stiffness [N m/rad]",
      largest(of("first_stiffness"), [&](size_t i) { return 2 * a * k * std::cosh(a * sigma(i)); }),
      1e-12);
  keeps("deflection of the other [rad]",
        largest(of("second_deflection"), [&](size_t i) { return q[i]; }), 1e-14);
  keeps("its torque [N m]", largest(of("second_spring_torque"), torque), 1e-12);
  keeps("its stiffness [N m/rad]", largest(of("second_stiffness"), stiffness), 1e-12);
  breaks(
      "control: its torque without sigma",
      largest(of("second_spring_torque"), [&](size_t i) { return -2 * k * std::sinh(a * q[i]); }),
      0.01);
}

// σ = 0.3 (1 - cos t) is 0.1 at t = acos(2/3) = 0.841, and 0.425 at 2 s.
TEST_F(SpringOutputs, ALeftRangeIsTold) {
  const auto notes_of = [&](double upper) {
    auto s = scene("");
    const auto& device = vsa::device("qbmove_advanced");
    vsa::Values values;
    for (const auto& p : device.parameters) values[p.name] = p.value;
    auto limits = device.limits;
    limits.sigma_lower = 0;
    limits.sigma_upper = upper;
    limits.sigma_stop_stiffness = 0;
    s.actuators[0].actuator.elastic = vsa::make_elastic(device.family, values, limits);
    std::string all;
    for (const auto& note : Series(s).report.notes)
      if (note.find("left the range") != note.npos) all += note + "\n";
    return all;
  };
  const std::string said = notes_of(0.1);
  EXPECT_NE(said.find("sigma of actuator 'first' [rad] left the range 0 to 0.1 of its limits"),
            said.npos)
      << said;
  EXPECT_NE(said.find("first at 0.84"), said.npos) << said;
  EXPECT_NE(said.find("farthest at 0.42"), said.npos) << said;
  EXPECT_EQ(notes_of(0.5), "") << "the control: it stays inside";
}

// The springs of a lever arm have the stiffness 2 ks σ² cos 2φ, negative beyond 45°.
TEST_F(SpringOutputs, ANegativeStiffnessIsTold) {
  const auto notes_of = [&](const char* start) {
    auto s = scene(outputs, start);
    s.actuators[1].actuator.elastic = vsa::lever_arm({.ks = 0.1}, {});
    const Series run(s);
    const auto q = run("output/q"), sigma = run("output/second_stiffness_setting");
    double least = 0;
    for (size_t i = 0; i < q.size(); ++i)
      least = std::fmin(least, 2 * 0.1 * sigma[i] * sigma[i] * std::cos(2 * q[i]));
    std::string all;
    for (const auto& note : run.report.notes)
      if (note.find("is negative") != note.npos) all += note;
    EXPECT_EQ(least < 0, all.find(fmt::format("least {:.4g} N m/rad", least)) != all.npos) << all;
    return all;
  };
  EXPECT_NE(notes_of("1.0").find("stiffness of actuator 'second' is negative: first at 0.0"),
            std::string::npos)
      << notes_of("1.0");
  EXPECT_EQ(notes_of("0.15"), "") << "the control: below 45 degrees";
}

TEST_F(SpringOutputs, AStopEndsTheRunAtAStiffness) {
  const Series s(scene(outputs + "[[stop]]\noutput = \"first_stiffness\"\nabove = 1.0\n"));
  const double sigma = std::acosh(1.0 / (2 * a * k)) / a;
  // The stop is found to rounding of K, whose slope is 2 a² k sinh(aσ) 0.3 sin t = 1.9 N m/rad/s.
  keeps("instant [s]", std::fabs(s.report.simulated_s - std::acos(1 - sigma / 0.3)), 1e-14);
  EXPECT_EQ(s.report.final_state.x.size(), s.assembly.initial.x.size());
}

TEST_F(SpringOutputs, TheMotionShowsTheSame) {
  const auto scene = this->scene(outputs);
  const Series s(scene);
  scene::MotionRecords records{s("time"), {}, [&](const std::string& n) { return s(n); }};
  records.springs = scene::springs_of(scene);
  const auto panels = scene::motion_panels(*s.assembly.mechanism, records);
  const std::pair<const char*, const char*> same[] = {
      {"deflections of springs [rad]", "deflection"},
      {"stiffness settings [rad]", "stiffness_setting"},
      {"stiffness of springs [N m/rad]", "stiffness"},
      {"torques of springs [N m]", "spring_torque"}};  // and torques and powers of motors
  for (const auto& [what, quantity] : same) {
    const auto p = std::find_if(panels.begin(), panels.end(),
                                [w = what](const auto& each) { return each.what == w; });
    ASSERT_TRUE(p != panels.end()) << what;
    ASSERT_EQ(p->lines.size(), 2u) << what;
    for (const auto& l : p->lines)
      EXPECT_EQ(l.value, s("output/" + l.name + "_" + quantity)) << what << ", " << l.name;
  }
  records.springs.clear();
  EXPECT_EQ(scene::motion_panels(*s.assembly.mechanism, records).size() + 6, panels.size());
}

TEST_F(SpringOutputs, TheResultsHaveThemAgain) {
  const auto scene = this->scene("");
  (void)scene::run(scene, scene::assemble(scene), into(folder_ / "out"));
  const std::string motion = read_bytes(folder_ / "out" / "motion.svg");
  EXPECT_TRUE(says(motion, "stiffness of springs"));
  (void)scene::replot(folder_ / "out");
  EXPECT_TRUE(read_bytes(folder_ / "out" / "motion.svg") == motion);
  EXPECT_EQ(scene::moved_in(folder_ / "out").springs.size(), 2u);
}

TEST_F(SpringOutputs, MistakesAreRefusedWithTheirLine) {
  const auto why = [&](const std::string& quantity, const std::string& of,
                       const std::string& more = "") {
    return refusal([&] {
      const auto s = scene(more + "[[output]]\nquantity = \"" + quantity +
                           "\"\nname = \"o\"\nactuator = \"" + of + "\"\n");
      (void)Series(s);
    });
  };
  EXPECT_TRUE(says(why("stiffness", "third"),
                   "scene.toml:37:1: output 'o': there is no [[actuator]] 'third', expected one "
                   "of: first, second"));
  EXPECT_TRUE(says(why("stiffness\"\nlink = \"x", "first"), "unknown key 'link' in [[output]]"));
  auto text = read_bytes(folder_ / "scene.toml");
  const std::string device = "device = \"qbmove_advanced\"";
  text.replace(text.find(device), device.size(), "device = \"sea_100\"");
  const size_t sigma = text.find("sigma = {");
  text.erase(sigma, text.find('\n', sigma) - sigma);
  text.replace(text.find("\"stiffness\""), 11, "\"stiffness_setting\"");
  text.replace(text.find("\nlink = \"x\""), 11, "");
  write_bytes(folder_ / "scene.toml", text);
  EXPECT_TRUE(says(refusal([&] {
                     const auto s = scene::read_scene((folder_ / "scene.toml").string());
                     (void)Series(s);
                   }),
                   "output 'o': the energy of actuator 'first' ('series_elastic') does not depend "
                   "on sigma, expected another quantity"));
}

}  // namespace
}  // namespace porthos::test::spring_outputs_test
