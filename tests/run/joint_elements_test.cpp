// Elements at joints of several freedoms: springs, dampers and torques at balls, free, cylindrical
// and universal joints, against closed forms; events, and what is refused.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "phs/scalars/derivative.h"
#include "phs/system/check.h"
#include "phs/system/resolvent.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::joint_elements_test {
namespace {

/// A ball of 2 kg and 0.3 kg m² with its centre at the joint.
const std::string ball_link =
    "<link name='body'><inertial><mass value='2'/><inertia ixx='0.3' iyy='0.3' izz='0.3' ixy='0' "
    "ixz='0' iyz='0'/></inertial></link>";
constexpr double inertia = 0.3, mass = 2;

std::string on_foot(const std::string& type, const std::string& body = ball_link,
                    const std::string& axes = "<axis xyz='0 0 1'/>") {
  return "<robot name='r'><link name='foot'/>" + body + "<joint name='j' type='" + type +
         "'><parent link='foot'/><child link='body'/><origin xyz='1 2 3' rpy='0.3 0.2 0.1'/>" +
         axes + "</joint></robot>";
}
std::string element(const std::string& type, const std::string& at, const std::string& keys) {
  return fmt::format("[[element]]\ntype = \"{}\"\njoint = \"{}\"\n{}\n", type, at, keys);
}
std::string output(const std::string& quantity, const std::string& joint) {
  return fmt::format("[[output]]\nquantity = \"{}\"\nname = \"{}\"\njoint = \"{}\"\n", quantity,
                     quantity, joint);
}

scene::Scene scene_of(const TemporaryFolder& folder, const std::string& urdf,
                      const std::string& more, double duration = 1, double step = 0.01,
                      const std::string& model = "base = \"fixed\"\n") {
  write_bytes(folder / "model.urdf", urdf);
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"model.urdf\"\n{}{}[integrator]\nmethod = \"gauss16\"\n"
                          "step = {:.17g}\n[run]\nduration = {:.17g}\n",
                          model, more, step, duration));
  return scene::read_scene((folder / "scene.toml").string());
}
struct Ran {
  scene::Assembly assembly;
  scene::RunReport report;
  const double* q() const { return report.final_state.x.data(); }
  std::vector<double> rates() const {
    return assembly.mechanical->rates(
        std::span(report.final_state.x).first(size_t(2 * assembly.mechanism->nq())),
        report.final_state.turns);
  }
  double output(const std::string& name) const {
    for (const auto& o : report.outputs)
      if (o.name == name) return o.end;
    return NAN;
  }
};
Ran run(const scene::Scene& s) {
  auto a = scene::assemble(s);
  auto r = scene::run_in_memory(s, a, {});
  return {std::move(a), std::move(r)};
}
std::string refusal(const std::string& urdf, const std::string& more,
                    const std::string& model = "base = \"fixed\"\n") {
  TemporaryFolder folder;
  try {
    (void)scene::assemble(scene_of(folder, urdf, more, 1, 0.01, model));
  } catch (const InvalidArgument& e) {
    const std::string text = e.what();
    const size_t at = text.find("scene.toml");
    return at == text.npos ? text : text.substr(text.find(": ", at) + 2);
  }
  return "(accepted)";
}
double far_apart(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) return HUGE_VAL;
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

}  // namespace

// I θ" = -k sin θ about any axis: a pendulum, T = 4 √(I/k) K(sin θ0/2).
TEST(JointElements, ABallSpringSwingsAsAPendulum) {
  TemporaryFolder folder;
  const double k = 1.7, angle = 1.9, axis[3] = {1. / 3, 2. / 3, -2. / 3};
  const double T = 4 * std::sqrt(inertia / k) * std::comp_ellint_1(std::sin(angle / 2));
  // From a rest attitude turned by `rest` about that axis, the start is `angle` further.
  const double rest = 0.4, half = (rest + angle) / 2;
  const auto quaternion = [&](double h) {
    return fmt::format("[{:.17g}, {:.17g}, {:.17g}, {:.17g}]", std::cos(h), axis[0] * std::sin(h),
                       axis[1] * std::sin(h), axis[2] * std::sin(h));
  };
  const std::string text =
      "[initial]\njoints.j.attitude_wxyz = " + quaternion(half) + "\n" +
      element("spring", "j",
              fmt::format("stiffness = {}\nrest_attitude_wxyz = {}", k, quaternion(rest / 2)));
  const auto once = run(scene_of(folder, on_foot("spherical"), text, T, T / 200));
  const double start[] = {std::cos(half), axis[0] * std::sin(half), axis[1] * std::sin(half),
                          axis[2] * std::sin(half)};
  const double error = far_apart(std::span(once.q(), 4), start);
  const auto rates = once.rates();
  std::printf("  after a period: attitude off by %.1e (1e-12), rates %.1e rad/s (1e-11)\n", error,
              far_apart(rates, std::vector<double>(3, 0.0)));
  EXPECT_LT(error, 1e-12);
  EXPECT_LT(far_apart(rates, std::vector<double>(3, 0.0)), 1e-11);
  EXPECT_TRUE(once.report.passed());
  EXPECT_LT(once.report.energy.max_rel_error, 1e-13);
  // Half a period: the other side of the rest attitude.
  const auto there = run(scene_of(folder, on_foot("spherical"), text, T / 2, T / 200));
  const double other = (rest - angle) / 2;
  EXPECT_NEAR(there.q()[0], std::cos(other), 1e-12);
  EXPECT_NEAR(there.q()[1], axis[0] * std::sin(other), 1e-12);
  // Negative control: the period of small angles.
  const double small = 2 * M_PI * std::sqrt(inertia / k);
  const auto wrong = run(scene_of(folder, on_foot("spherical"), text, small, small / 200));
  EXPECT_GT(far_apart(std::span(wrong.q(), 4), start), 0.1);
}

// ω = ω0 exp(-d t / I) about any axis; the ledger's row is the energy that is gone.
TEST(JointElements, ADampedBallLosesWhatItsLedgerSays) {
  TemporaryFolder folder;
  const double d = 0.2, w0[3] = {1, -2, 0.5};
  const auto r = run(scene_of(folder, on_foot("spherical"),
                              "[initial]\njoints.j.angular_velocity = [1, -2, 0.5]\n" +
                                  element("damper", "j", "damping = 0.2")));
  const auto w = r.rates();
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(w[i], w0[i] * std::exp(-d / inertia), 1e-14);
  const double H0 = 0.5 * inertia * 5.25, lost = H0 * (1 - std::exp(-2 * d / inertia));
  const double row = entry_of(r.report.losses, "j.damper");
  std::printf("  lost %.15g J, closed form off by %.1e J, balance %.1e J (1e-14)\n", row,
              row - lost, r.report.defect_J);
  EXPECT_NEAR(row, lost, 1e-14);
  EXPECT_NEAR(r.report.defect_J, 0, 1e-14);
  // One freedom alone: the rate about z falls, those about the others stay.
  const auto z = run(scene_of(folder, on_foot("spherical"),
                              "[initial]\njoints.j.angular_velocity = [0, 0, 2]\n" +
                                  element("damper", "j.about_z", "damping = 0.2")));
  EXPECT_NEAR(z.rates()[2], 2 * std::exp(-d / inertia), 1e-14);
  const auto x = run(scene_of(folder, on_foot("spherical"),
                              "[initial]\njoints.j.angular_velocity = [0, 0, 2]\n" +
                                  element("damper", "j.about_x", "damping = 0.2")));
  EXPECT_NEAR(x.rates()[2], 2, 1e-14);
}

TEST(JointElements, ATorqueAboutAnAxisOfTheChild) {
  TemporaryFolder folder;
  const auto r =
      run(scene_of(folder, on_foot("spherical"),
                   element("force", "j.about_y", "constant = 0.6") +
                       output("joint_torque", "j.about_y") + output("joint_rate", "j.about_y")));
  EXPECT_NEAR(r.rates()[1], 0.6 / inertia, 1e-14);
  EXPECT_NEAR(r.output("joint_torque"), 0.6, 1e-15);
  EXPECT_NEAR(r.output("joint_rate"), 0.6 / inertia, 1e-14);
  // About y by τt²/2I: its x is where it was turned to.
  const double angle = 0.5 * 0.6 / inertia;
  EXPECT_NEAR(r.q()[2], std::sin(angle / 2), 1e-14);
  EXPECT_NEAR(entry_of(r.report.ports, "j.about_y.force"), 0.6 * angle, 1e-14);
  // A spring's torque: -k sin θ.
  const auto s = run(scene_of(folder, on_foot("spherical"),
                              "[initial]\njoints.j.attitude_wxyz = [0.8, 0, 0.6, 0]\n" +
                                  element("spring", "j", "stiffness = 1e-9") +
                                  output("joint_torque", "j.about_y"),
                              0.01));
  EXPECT_NEAR(s.output("joint_torque") / 1e-9, -2 * 0.8 * 0.6, 1e-7);
}

// r = r0 cos ωt + v0/ω sin ωt about the rest, ω² = k/m; the attitude turns beside it.
TEST(JointElements, SpringsAtAFreeJoint) {
  TemporaryFolder folder;
  const double k = 5, w = std::sqrt(k / mass);
  const auto r = run(
      scene_of(folder, on_foot("floating"),
               "[initial]\njoints.j = { position = [1, 0.5, -0.2], linear_velocity = [0, 0.3, 1], "
               "angular_velocity = [1, 2, 3] }\n" +
                   element("spring", "j.position", "stiffness = 5\nrest_position = [0.1, 0, 0]")));
  const double rest[3] = {0.1, 0, 0}, r0[3] = {0.9, 0.5, -0.2}, v0[3] = {0, 0.3, 1};
  for (size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(r.q()[i], rest[i] + r0[i] * std::cos(w) + v0[i] / w * std::sin(w), 1e-13);
  EXPECT_TRUE(r.report.passed());
  // Dampers on both: exponentials.
  const auto damped = run(scene_of(
      folder, on_foot("floating"),
      "[initial]\njoints.j = { linear_velocity = [0, 0.3, 1], angular_velocity = [1, 2, 3] }\n" +
          element("damper", "j.position", "damping = 0.7") +
          element("damper", "j.attitude", "damping = 0.2")));
  const auto v = damped.rates();
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(v[i], double(i + 1) * std::exp(-0.2 / inertia), 1e-13);
  EXPECT_NEAR(std::hypot(v[3], v[4], v[5]), std::hypot(0.3, 1) * std::exp(-0.7 / mass), 1e-13);
  EXPECT_NEAR(damped.report.defect_J, 0, 1e-14);
  // A force along the child's z.
  const auto pushed = run(scene_of(
      folder, on_foot("floating"),
      element("force", "j.along_z", "constant = 3") + output("joint_torque", "j.along_z")));
  EXPECT_NEAR(pushed.q()[2], 0.5 * 3 / mass, 1e-14);
  EXPECT_NEAR(pushed.output("joint_torque"), 3, 1e-14);
}

/// Two hinges with a massless cross between them, or a universal joint: the same bits.
TEST(JointElements, AUniversalJointIsTwoHinges) {
  TemporaryFolder folder;
  const std::string body = link("body", 2);
  const std::string hinges =
      "<robot name='r'><link name='foot'/><link name='cross'/>" + body +
      "<joint name='a' type='continuous'><parent link='foot'/><child link='cross'/><origin xyz='1 "
      "2 3' rpy='0.3 0.2 0.1'/><axis xyz='1 0 0'/></joint><joint name='b' type='continuous'>"
      "<parent link='cross'/><child link='body'/><axis xyz='0 1 0'/></joint></robot>";
  const auto acting = [&](const std::string& first, const std::string& second) {
    return "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n[initial]\njoints.\"" +
           first + "\" = { position = 0.5, velocity = 1 }\njoints.\"" + second +
           "\" = { position = -0.3, velocity = 2 }\n" +
           element("spring", first, "stiffness = 3\nrest = 0.2\nname = \"spring\"") +
           element("damper", second, "damping = 0.1\nname = \"damper\"") +
           element("dc_motor", second,
                   "inductance = 0.2\nresistance = 1\nconstant = 0.3\nvoltage = { constant = 1 }\n"
                   "name = \"motor\"") +
           element("controller", first, "stiffness = 2\ndamping = 0.5\nrate = 10\nname = \"law\"");
  };
  const auto two = run(scene_of(folder, hinges, acting("a", "b"), 1, 0.01,
                                "base = \"fixed\"\nlinks_without_inertia = \"massless\"\n"));
  const auto one =
      run(scene_of(folder, on_foot("universal", body, "<axis xyz='1 0 0'/><axis2 xyz='0 1 0'/>"),
                   acting("j.first", "j.second")));
  EXPECT_EQ(two.report.final_state.x, one.report.final_state.x);
  EXPECT_EQ(two.report.losses, one.report.losses);
  EXPECT_NE(one.q()[0], 0.5);
}

/// The turn of a sleeve whose centre is on its axis does not feel the slide: a hinge.
TEST(JointElements, ASleeveTurnsAsAHingeAndSlidesAsASlider) {
  TemporaryFolder folder;
  const auto acting = [&](const std::string& at, const std::string& keys) {
    return "[initial]\njoints.\"" + at + "\" = { position = 0.5, velocity = 1 }\n" + keys;
  };
  const auto turning = [&](const std::string& at) {
    return acting(
        at, element("damper", at, "damping = 0.1") +
                element("dc_motor", at,
                        "inductance = 0.2\nresistance = 1\nconstant = 0.3\nvoltage = { constant "
                        "= 1 }") +
                element("controller", at, "target = 1\nstiffness = 2\ndamping = 0.1") +
                output("joint_torque", at) + output("joint_rate", at));
  };
  const auto sleeve = run(scene_of(folder, on_foot("cylindrical"), turning("j.angle"))),
             hinge = run(scene_of(folder, on_foot("continuous"), turning("j")));
  EXPECT_NEAR(sleeve.q()[0], hinge.q()[0], 1e-15);
  EXPECT_EQ(sleeve.q()[1], 0);
  EXPECT_NEAR(sleeve.output("joint_torque"), hinge.output("joint_torque"), 1e-14);
  EXPECT_NEAR(sleeve.output("joint_rate"), hinge.output("joint_rate"), 1e-14);
  const std::string elastic =
      "family = \"series_elastic\"\nparameters = { k = 20 }\ntheta = { drive = \"torque\", inertia "
      "= 0.1, command = { constant = 0.3 }, viscous = 0.1 }\n";
  const auto driven = [&](const std::string& at) {
    return acting(at, "[[actuator]]\njoint = \"" + at + "\"\n" + elastic);
  };
  const auto a = run(scene_of(folder, on_foot("cylindrical"), driven("j.angle"))),
             b = run(scene_of(folder, on_foot("continuous"), driven("j")));
  EXPECT_NEAR(a.q()[0], b.q()[0], 1e-14);
  EXPECT_GT(std::fabs(a.q()[0] - 0.5), 0.01);
  // And slides: a spring and a mass.
  const auto slide =
      run(scene_of(folder, on_foot("cylindrical"),
                   acting("j.slide", element("spring", "j.slide", "stiffness = 8"))));
  EXPECT_NEAR(slide.q()[1], 0.5 * std::cos(2) + 0.5 * std::sin(2), 1e-13);
}

std::string floating_arm(const std::string& type) {
  return "<robot name='r'>" + link("bus", 5) + link("hand", 2) + "<joint name='wrist' type='" +
         type +
         "'><parent link='bus'/><child link='hand'/><origin xyz='0.3 0.1 -0.5'/><axis xyz='1 0 "
         "0'/></joint></robot>";
}
const char* const free_base = "base = \"free\"\n";
const std::string thrown =
    "[initial]\nbase.angular_velocity = [0.1, 0.2, -0.3]\njoints.wrist = { attitude_wxyz = [0.9, "
    "0.3, 0.1, -0.2], angular_velocity = [1, 2, -1] }\n";
const std::string wrist_parts =
    element("spring", "wrist", "stiffness = 4") + element("damper", "wrist", "damping = 0.1");

TEST(JointElements, InsideAFloatingMechanismTheyKeepItsMomentum) {
  TemporaryFolder folder;
  const auto r =
      run(scene_of(folder, floating_arm("spherical"), thrown + wrist_parts, 5, 0.01, free_base));
  EXPECT_TRUE(phs::check(*r.assembly.model).holds()) << phs::check(*r.assembly.model).text();
  EXPECT_TRUE(r.report.passed());
  std::printf(
      "  floating arm: angular momentum %.1e (1e-13), balance %.1e J of %.2g J lost (1e-13)\n",
      r.report.angular_momentum_error, r.report.defect_J, r.report.dissipated_J);
  EXPECT_LT(r.report.angular_momentum_error, 1e-13);
  EXPECT_LT(r.report.quaternion_norm_error, 1e-13);
  EXPECT_GT(r.report.dissipated_J, 0.1);
  EXPECT_LT(std::fabs(r.report.defect_J), 1e-13);
  // On the ground a spring changes the angular momentum of a balanced ball: it is no invariant.
  const auto invariants = [&](const std::string& more) {
    const auto a = scene::assemble(scene_of(folder, on_foot("spherical"), more));
    std::vector<std::string> names;
    for (const auto& i : a.model->description().invariants) names.push_back(i.name);
    return names;
  };
  const auto with = invariants(element("spring", "j", "stiffness = 4")), without = invariants("");
  EXPECT_EQ(std::count(without.begin(), without.end(), "angular_momentum"), 1);
  EXPECT_EQ(std::count(with.begin(), with.end(), "angular_momentum"), 0);
  EXPECT_EQ(std::count(with.begin(), with.end(), "quaternion_norm.j"), 1);
  EXPECT_EQ(std::count(with.begin(), with.end(), "quaternion_gauge.j"), 1);
}

/// A motor about each of two axes of a ball: a gyrator each, on one component of its port.
TEST(JointElements, MotorsAtABall) {
  TemporaryFolder folder;
  const auto motor = [](const std::string& at, const std::string& name) {
    return element("dc_motor", at,
                   "inductance = 0.2\nresistance = 1\nconstant = 0.3\nvoltage = { constant = 1 "
                   "}\nname = \"" +
                       name + "\"");
  };
  const auto both = scene_of(folder, on_foot("spherical"),
                             motor("j.about_x", "first") + motor("j.about_y", "second"));
  const auto r = run(both);
  EXPECT_TRUE(phs::check(*r.assembly.model).holds()) << phs::check(*r.assembly.model).text();
  EXPECT_EQ(r.rates()[0], r.rates()[1]) << "of a ball, about two axes alike";
  EXPECT_GT(r.rates()[0], 0.01);
  EXPECT_NEAR(r.rates()[2], 0, 1e-16);
  EXPECT_LT(std::fabs(r.report.defect_J), 1e-14);
  EXPECT_TRUE(says(
      refusal(on_foot("spherical"), motor("j.about_x", "first") + motor("j.about_x", "second")),
      "is joined by"));
  EXPECT_TRUE(says(refusal(on_foot("floating"), motor("j.along_x", "first")), "takes N"));
}

/// They are inactive while their joint is locked, and the run is resumed with the same bits.
TEST(JointElements, LocksAndResults) {
  TemporaryFolder folder;
  const std::string events =
      "[[event]]\ntype = \"lock\"\njoint = \"wrist\"\nat = 0.5\n[[event]]\ntype = "
      "\"unlock\"\njoint "
      "= \"wrist\"\nat = 0.8\n";
  for (const char* type : {"spherical", "universal"}) {
    const bool ball = std::string(type) == "spherical";
    const std::string parts =
        ball ? thrown + wrist_parts +
                   element("force", "wrist.about_x", "sine = { amplitude = 1, frequency = 2 }")
             : element("spring", "wrist.first", "stiffness = 4") +
                   element("force", "wrist.second", "sine = { amplitude = 1, frequency = 2 }");
    const auto s = scene_of(folder, floating_arm(type), parts + events, 1.2, 0.01, free_base);
    const auto a = scene::assemble(s);
    const auto r = scene::run(s, a, into(folder / type));
    EXPECT_TRUE(r.passed()) << type;
    EXPECT_EQ(r.phases, 3) << type;
    EXPECT_EQ(r.final_state.x, scene::run_in_memory(s, a, {}).final_state.x) << type;
  }
}

/// The resolvent of stiff steps has the whole curvature of a ball's spring.
TEST(JointElements, TheResolventKnowsTheCurvature) {
  TemporaryFolder folder;
  const auto a = scene::assemble(
      scene_of(folder, on_foot("spherical"),
               "[initial]\njoints.j = { attitude_wxyz = [0.8, 0.3, -0.4, 0.2], angular_velocity = "
               "[1, 2, -1] }\n" +
                   element("spring", "j", "stiffness = 4000")));
  const auto f = a.model->instantiate<double>();
  const auto dual = a.model->instantiate<phs::Dual>();
  const auto resolvent = f->resolvent();
  ASSERT_TRUE(resolvent);
  const size_t n = a.initial.x.size();
  const phs::Complex4 z(0.01);
  resolvent->factor(0, a.initial.x, z);
  std::mt19937_64 rng(3);
  std::vector<phs::Complex4> r(n), d(n);
  std::vector<double> right(n);
  for (size_t i = 0; i < n; ++i) {
    right[i] = double(rng() >> 11) * 0x1p-53 - 0.5;
    d[i] = r[i] = phs::Complex4(right[i]);
  }
  resolvent->solve(d);
  // (I - z J) d against r, J by duals along d.
  std::vector<phs::Dual> x(n), dx(n);
  for (size_t i = 0; i < n; ++i) x[i] = {a.initial.x[i], phs::lane_of(d[i].re, 0)};
  dual->field(phs::Dual(0.0), x, {}, dx);
  double error = 0, size = 0;
  for (size_t i = 0; i < n; ++i) {
    error = std::max(error, std::fabs(x[i].d - 0.01 * dx[i].d - right[i]));
    size = std::max(size, std::fabs(0.01 * dx[i].d));
  }
  std::printf("  (I - zJ) d off by %.1e of %.2g (1e-12)\n", error, size);
  EXPECT_LT(error, 1e-12 * (1 + size));
}

TEST(JointElements, Refusals) {
  const std::string ball = on_foot("spherical"), sleeve = on_foot("cylindrical"),
                    loose = on_foot("floating");
  EXPECT_EQ(
      refusal(ball, element("force", "j", "constant = 1")),
      "element 'j.force': a force acts at one degree of freedom and 'j' has 3, expected one of: "
      "j.about_x, j.about_y, j.about_z");
  EXPECT_EQ(
      refusal(ball, element("spring", "j.about_x", "stiffness = 1")),
      "element 'j.about_x.spring': a spring depends on a coordinate of one number and "
      "'j.about_x' is a rate without a coordinate, expected a joint of one degree of freedom");
  EXPECT_EQ(refusal(ball, element("spring", "j", "stiffness = 1\nrest = 0.3")),
            "element 'j.spring': rest is given at 'j', which is a coordinate of several numbers, "
            "expected stiffness and rest_attitude_wxyz");
  EXPECT_EQ(refusal(ball, element("spring", "j", "stiffness = 1\nrest_position = [1, 0, 0]")),
            "element 'j.spring': rest_position is given at 'j', which is an attitude, expected "
            "rest_attitude_wxyz");
  EXPECT_EQ(
      refusal(sleeve, element("spring", "j.slide", "stiffness = 1\nrest_position = [1, 0, 0]")),
      "element 'j.slide.spring': rest_position is given at 'j.slide', which is a coordinate "
      "of one number, expected rest");
  EXPECT_EQ(refusal(ball, element("spring", "j", "stiffness = -1")),
            "spring: stiffness is -1, expected 0 or more");
  EXPECT_EQ(refusal(sleeve, element("spring", "j", "stiffness = 1")),
            "element 'j.spring': joint 'j' has several coordinates, expected one of: j.angle, "
            "j.slide");
  EXPECT_EQ(refusal(loose, element("damper", "j", "damping = 1")),
            "element 'j.damper': joint 'j' has several coordinates, expected one of: j.position, "
            "j.attitude, j.along_x, j.along_y, j.along_z, j.about_x, j.about_y, j.about_z");
  EXPECT_EQ(refusal(floating_arm("spherical"), element("damper", "base.attitude", "damping = 1"),
                    free_base),
            "element 'base.attitude.damper': 'base' floats freely in space, expected a joint "
            "between two links (on a link acts an element of type \"wrench\")");
  EXPECT_EQ(refusal(ball, element("damper", "k", "damping = 1")),
            "element 'k.damper': the model has no joint 'k', expected one of: j");
  EXPECT_EQ(refusal(ball, output("joint_position", "j")),
            "output 'joint_position': joint 'j' turns freely, expected quantity = \"attitude\", "
            "\"angle\" or \"position\" of its link");
  EXPECT_EQ(
      refusal(ball, output("joint_rate", "j")),
      "output 'joint_rate': joint 'j' has several degrees of freedom, expected one of: j.about_x, "
      "j.about_y, j.about_z");
  EXPECT_TRUE(
      says(refusal(ball, element("limits", "j", "lower = -1\nupper = 1\nstiffness = 1")),
           "of one number and 'j' is one of several, expected a joint of one degree of freedom"));
  EXPECT_TRUE(says(refusal(sleeve,
                           "[[controller]]\ntype = 'potential'\nname = 'law'\njoints.\"j.angle\" = "
                           "{ stiffness = 1, damping = 1, target = 0 }\n"),
                   "'j.angle' is one of 2 degrees of freedom of its joint, expected a joint of one "
                   "degree of freedom"));
}

}  // namespace porthos::test::joint_elements_test
