// Outputs of a scene against closed forms and against each other; stops at their instants, in runs
// without and with events, in orbit, resumed and in memory; and what is refused.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "integrators/core/integrator.h"
#include "scene/ensemble/ensemble.h"
#include "scene/run/columns.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::outputs_test {
namespace {

using Rows = std::vector<std::vector<double>>;

constexpr double g = 9.81;

/// A rod of 2 kg, 1 m below its hinge about y.
const std::string rod =
    "<robot name='rod'><link name='foot'/><link name='rod'><inertial><origin xyz='0 0 -0.6'/>"
    "<mass value='2'/><inertia ixx='0.1' iyy='0.3' izz='0.2' ixy='0' ixz='0' iyz='0'/></inertial>"
    "</link><joint name='hinge' type='continuous'><parent link='foot'/><child link='rod'/>"
    "<origin xyz='0 0 0.2'/><axis xyz='0 1 0'/></joint></robot>";
const std::string falling = "[environment]\ngravity = \"uniform\"\nvector = [0, 0, -9.81]\n";

std::string output(const std::string& quantity, const std::string& name, const std::string& keys) {
  return fmt::format("[[output]]\nquantity = \"{}\"\nname = \"{}\"\n{}\n", quantity, name, keys);
}
scene::Scene scene_of(const TemporaryFolder& folder, const std::string& urdf,
                      const std::string& more, double duration = 2, const char* base = "fixed",
                      const std::string& run = "") {
  write_bytes(folder / "model.urdf", urdf);
  write_bytes(folder / "scene.toml",
              fmt::format("[model]\nurdf = \"model.urdf\"\nbase = \"{}\"\n{}[integrator]\nmethod = "
                          "\"gauss8\"\nstep = 0.01\n[run]\nduration = {}\nrecord_every = 0.01\n{}",
                          base, more, duration, run));
  return scene::read_scene((folder / "scene.toml").string());
}
/// The records of a run, and the columns of a series in them.
class Recorded {
 public:
  explicit Recorded(const scene::Scene& s) : assembly(scene::assemble(s)) {
    scene::MemoryOptions o;
    o.record = [this](std::span<const double> row) { rows_.emplace_back(row.begin(), row.end()); };
    report = scene::run_in_memory(s, assembly, o);
    const auto& d = assembly.model->description();
    columns_ = scene::columns_of(d, scene::RecordLayout(s, assembly));
  }
  size_t size() const { return rows_.size(); }
  double at(size_t i, const std::string& name, size_t k = 0) const {
    for (const auto& c : columns_)
      if (c.name == name) return rows_[i][c.first + k];
    return NAN;
  }
  scene::Assembly assembly;
  scene::RunReport report;

 private:
  Rows rows_;
  std::vector<scene::Column> columns_;
};
std::string refusal(const std::string& more, const std::string& start = falling) {
  TemporaryFolder folder;
  try {
    const auto s = scene_of(folder, rod, start + more);
    (void)Recorded(s);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}
double largest_off(const Recorded& r, const std::function<double(size_t)>& off) {
  double most = 0;
  for (size_t i = 0; i < r.size(); ++i)
    if (const double x = std::fabs(off(i)); !(x <= most)) most = x;
  return most;
}

}  // namespace

TEST(Outputs, OfARodAreItsClosedForms) {
  TemporaryFolder folder;
  const auto s = scene_of(
      folder, rod,
      falling + "[initial]\njoints.hinge = { position = 2.5, velocity = 3 }\n" +
          "[[element]]\ntype = \"spring\"\njoint = \"hinge\"\nstiffness = 4\nrest = 0.3\n" +
          output("position", "tip", "link = \"rod\"\nat = [0, 0, -1]") +
          output("position", "foot_seen", "link = \"world\"\nrelative_to = \"rod\"") +
          output("velocity", "speed", "link = \"rod\"\nat = [0, 0, -1]") +
          output("attitude", "xi", "link = \"rod\"") + output("angle", "angle", "link = \"rod\"") +
          output("euler_angles", "turned", "link = \"rod\"\nsequence = \"xzy\"") +
          output("angular_velocity", "w", "link = \"rod\"") +
          output("distance", "gap",
                 "link = \"rod\"\nat = [0, 0, -1]\nradius = 0.1\nrelative_at = [0, 0, -2]\n"
                 "relative_radius = 0.2") +
          output("joint_position", "q", "joint = \"hinge\"") +
          output("joint_rate", "qd", "joint = \"hinge\"") +
          output("joint_torque", "tau", "joint = \"hinge\"") +
          output("joint_wrench", "load", "joint = \"hinge\"") +
          output("centre_of_mass", "com", "") + output("momentum", "P", "") +
          output("angular_momentum", "L", "link = \"rod\"") +
          output("energy", "T", "row = \"kinetic\"") +
          output("formula", "reach", "formula = \"sqrt(tip.x^2 + (tip.z - 0.2)^2)\"\nunit = \"m\""),
      4);
  const Recorded r(s);
  ASSERT_GT(r.size(), 300u);
  const double l = 0.6, m = 2, I = 0.3 + m * l * l;
  struct Now {
    double q, w, a;  ///< angle, rate, acceleration
  };
  const auto now = [&](size_t i) {
    const double q = r.at(i, "output/q"), w = r.at(i, "output/qd");
    return Now{q, w, (-m * g * l * std::sin(q) - 4 * (q - 0.3)) / I};
  };
  const auto check = [&](const std::string& name, size_t k, auto expected, double bound) {
    const double off =
        largest_off(r, [&](size_t i) { return r.at(i, "output/" + name, k) - expected(now(i)); });
    EXPECT_LE(off, bound) << name << k;
  };
  // Measured: 2e-15 or less for lengths, 5e-14 for forces of up to 90 N.
  check(
      "tip", 0, [](Now n) { return -std::sin(n.q); }, 1e-14);
  check(
      "tip", 2, [](Now n) { return 0.2 - std::cos(n.q); }, 1e-14);
  check(
      "foot_seen", 0, [](Now n) { return 0.2 * std::sin(n.q); }, 1e-14);
  check(
      "foot_seen", 2, [](Now n) { return -0.2 * std::cos(n.q); }, 1e-14);
  check(
      "speed", 0, [](Now n) { return -n.w * std::cos(n.q); }, 1e-13);
  check(
      "speed", 2, [](Now n) { return n.w * std::sin(n.q); }, 1e-13);
  check(
      "xi", 0, [](Now n) { return std::fabs(std::cos(n.q / 2)); }, 1e-14);
  check(
      "angle", 0, [](Now n) { return std::fabs(std::remainder(n.q, 2 * M_PI)); }, 1e-14);
  check(
      "turned", 1, [](Now n) { return std::remainder(n.q, 2 * M_PI); }, 1e-14);
  check(
      "w", 1, [](Now n) { return n.w; }, 1e-14);
  check(
      "gap", 0, [](Now n) { return std::hypot(std::sin(n.q), 2.2 - std::cos(n.q)) - 0.3; }, 1e-14);
  check(
      "tau", 0, [](Now n) { return -4 * (n.q - 0.3); }, 1e-12);
  check(
      "com", 0, [&](Now n) { return -l * std::sin(n.q); }, 1e-14);
  check(
      "P", 0, [&](Now n) { return -m * l * n.w * std::cos(n.q); }, 1e-13);
  check(
      "L", 1, [](Now n) { return 0.3 * n.w; }, 1e-13);
  check(
      "T", 0, [&](Now n) { return I * n.w * n.w / 2; }, 1e-12);
  check(
      "reach", 0, [](Now) { return 1.0; }, 1e-14);
  // The moment about the hinge's axis is what acts there; the forces are m (a - g), own axes.
  check(
      "load", 1, [](Now n) { return -4 * (n.q - 0.3); }, 1e-12);
  check(
      "load", 3, [&](Now n) { return -m * l * n.a - m * g * std::sin(n.q); }, 1e-12);
  check(
      "load", 5, [&](Now n) { return m * l * n.w * n.w + m * g * std::cos(n.q); }, 1e-12);
  // Negative control: without the weight the force along the rod is another.
  EXPECT_GT(
      largest_off(
          r, [&](size_t i) { return r.at(i, "output/load", 5) - m * l * now(i).w * now(i).w; }),
      10);
}

TEST(Outputs, AngularMomentaOfGroupsAddUpAboutTheCommonCentre) {
  TemporaryFolder folder;
  const std::string start =
      "[initial]\nbase.linear_velocity = [70, 0, -40]\nbase.angular_velocity = [0.1, -0.2, 0.3]\n"
      "joints.shoulder.velocity = 1\njoints.elbow = { position = 0.5, velocity = -2 }\n";
  const std::string arm = "links = [\"upper\", \"lower\"]\n", all = "about = \"all\"\n",
                    body = "link = \"body\"\n";
  const Recorded r(scene_of(
      folder, arm_urdf(),
      start + output("angular_momentum", "L", "") + output("angular_momentum", "L_all", all) +
          output("angular_momentum", "arm", arm + all) +
          output("angular_momentum", "body", body + all) +
          output("angular_momentum", "arm_own", arm) +
          output("angular_momentum", "body_own", body) + output("momentum", "P", "") +
          output("momentum", "P_arm", arm) + output("momentum", "P_body", body),
      3, "free"));
  double angular = 0, linear = 0, same = 0, own = 0;
  for (size_t i = 0; i < r.size(); ++i)
    for (size_t k = 0; k < 3; ++k) {
      const auto at = [&](const char* name) { return r.at(i, std::string("output/") + name, k); };
      angular = std::max(angular, std::fabs(at("L") - at("arm") - at("body")));
      linear = std::max(linear, std::fabs(at("P") - at("P_arm") - at("P_body")));
      same = std::max(same, std::fabs(at("L") - at("L_all")));
      own = std::max(own, std::fabs(at("L") - at("arm_own") - at("body_own")));
    }
  keeps("angular momentum of all less arm and body [kg m^2/s]", angular, 1e-9);
  keeps("momentum likewise [kg m/s]", linear, 1e-12);
  keeps("that of all about itself", same, 1e-9);
  breaks("about their own centres they do not", own, 0.1);
  const auto refused = [&](const std::string& keys) {
    return test::refusal(
        [&] { Recorded(scene_of(folder, arm_urdf(), output("momentum", "P", keys), 1)); });
  };
  EXPECT_TRUE(says(refused(arm + body), "links is given besides link, expected one of both"));
  EXPECT_TRUE(says(refused("links = []\n"), "links is empty"));
  EXPECT_TRUE(says(refused("links = [\"upper\", \"hand\"]\n"), "'hand'"));
}

namespace {
/// Of a free flyer, with more tables in its scene.
void add_up(const std::string& more, double bound) {
  TemporaryFolder folder;
  auto s = scene_of(
      folder, arm_urdf(),
      "[initial]\nbase.linear_velocity = [0.3, 0, -0.1]\nbase.angular_velocity "
      "= [0.1, -0.2, 0.3]\njoints.shoulder.velocity = 1\njoints.elbow = { "
      "position = 0.5, velocity = -2 }\n" +
          output("momentum", "P", "") + output("momentum", "P_body", "link = \"body\"") +
          output("momentum", "P_upper", "link = \"upper\"") +
          output("momentum", "P_lower", "link = \"lower\"") + output("angular_momentum", "L", "") +
          output("centre_of_mass", "com", "") + output("attitude", "xi", "link = \"upper\"") +
          output("joint_wrench", "load", "joint = \"shoulder\"") + more,
      3, "free");
  if (s.is_constrained()) s.method = "spark8";
  const Recorded r(s);
  double sum = 0, moved = 0, centre = 0, newton = 0, control = 0;
  for (size_t i = 2; i + 2 < r.size(); ++i) {
    const double h = 0.01;
    const double t = r.at(i, "time");
    double f_world[3],
        f[3] = {r.at(i, "output/load", 3), r.at(i, "output/load", 4), r.at(i, "output/load", 5)};
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>{
        r.at(i, "output/xi", 0),
        {r.at(i, "output/xi", 1), r.at(i, "output/xi", 2), r.at(i, "output/xi", 3)}});
    const auto world = R * mechanics::Vec3d{f[0], f[1], f[2]};
    for (int k = 0; k < 3; ++k) f_world[k] = world[k];
    for (size_t k = 0; k < 3; ++k) {
      const auto at = [&](const char* name, size_t row) {
        return r.at(row, std::string("output/") + name, k);
      };
      sum = std::max(sum,
                     std::fabs(at("P", i) - at("P_body", i) - at("P_upper", i) - at("P_lower", i)));
      moved = std::max(moved, std::fabs(at("L", i) - at("L", 0)));
      centre = std::max(centre, std::fabs(at("com", i) - at("com", 0) - t / 25 * at("P", 0)));
      // The body loses what the joint gives to the arm; differences of order 4.
      const double rate = (8 * (at("P_body", i + 1) - at("P_body", i - 1)) -
                           (at("P_body", i + 2) - at("P_body", i - 2))) /
                          (12 * h);
      newton = std::max(newton, std::fabs(rate + f_world[k]));
      control = std::max(control, std::fabs(rate + f[k]));
    }
  }
  EXPECT_LE(sum, 1e-14);    // 2e-15
  EXPECT_LE(moved, 1e-13);  // 1e-14
  EXPECT_LE(centre, 1e-13);
  EXPECT_LE(newton, bound);
  EXPECT_GT(control, 0.1);  // in the wrong axes
}
}  // namespace

TEST(Outputs, OfAFreeFlyerAddUp) { add_up("", 1e-4); }  // h⁴/30 P⁗ of a few N at 3 rad/s

TEST(Outputs, OfAFreeFlyerWithACouplingAddUp) {
  add_up("[[coupling]]\nname = \"gear\"\nfactors = { shoulder = 2, elbow = 1 }\noffset = 0.5\n",
         1e-4);
}

TEST(Outputs, ATorqueOfASampledControllerIsHeldBetweenItsInstants) {
  TemporaryFolder folder;
  const auto s = scene_of(folder, rod,
                          falling + "[initial]\njoints.hinge = { position = 1 }\n" +
                              "[[element]]\ntype = \"controller\"\njoint = \"hinge\"\nstiffness = "
                              "30\ndamping = 3\nrate = 10\n" +
                              output("joint_torque", "tau", "joint = \"hinge\"") +
                              output("joint_position", "q", "joint = \"hinge\"") +
                              output("joint_rate", "qd", "joint = \"hinge\""));
  const Recorded r(s);
  size_t instants = 0;
  double off = 0, moved = 0;
  for (size_t i = 1; i + 1 < r.size(); ++i) {
    // A record at an instant is taken before the sample.
    const auto held = i - 1 - (i - 1) % 10;
    const double q = r.at(held, "output/q"), w = r.at(held, "output/qd");
    off = std::max(off, std::fabs(r.at(i, "output/tau") + 30 * q + 3 * w));
    moved = std::max(moved, std::fabs(r.at(i, "output/q") - q));
    instants += held == i - 1;
  }
  EXPECT_GT(instants, 15u);
  EXPECT_LE(off, 1e-12);  // 1e-14
  EXPECT_GT(moved, 0.1);  // a continuous law would follow
  EXPECT_NEAR(r.at(0, "output/tau"), -30, 1e-12) << "the first record has the first sample";
}

TEST(Outputs, WithExtremaTheirLargestIsThatOfAllSteps) {
  TemporaryFolder folder;
  auto s = scene_of(folder, rod,
                    falling + "[initial]\njoints.hinge = { position = 1 }\n" +
                        "[[element]]\ntype = \"controller\"\njoint = \"hinge\"\nstiffness = "
                        "30\ndamping = 3\nrate = 10\n" +
                        output("joint_torque", "tau", "joint = \"hinge\""));
  const auto of = [&](double record_every, scene::Extrema extrema) {
    s.record_every = record_every;
    s.extrema = extrema;
    return scene::run_in_memory(s, scene::assemble(s), {});
  };
  const auto all = of(s.step, scene::Extrema::none), rare = of(0.7, scene::Extrema::none),
             watched = of(0.7, scene::Extrema::all);
  EXPECT_EQ(watched.outputs[0].least, all.outputs[0].least);
  EXPECT_EQ(watched.outputs[0].largest, all.outputs[0].largest);
  EXPECT_LT(rare.outputs[0].largest, all.outputs[0].largest) << "control";
  const auto noted = [](const scene::RunReport& r) {
    return std::ranges::any_of(r.notes, [](const auto& n) {
      return says(n,
                  "outputs are those of the records, every 0.7 s, while 'hinge.controller' "
                  "samples every 0.1 s");
    });
  };
  EXPECT_TRUE(noted(rare));
  EXPECT_FALSE(noted(watched));
  EXPECT_FALSE(noted(all));
}

TEST(Outputs, AreTheSameInFilesInMemoryAndResumed) {
  TemporaryFolder folder;
  const std::string more = falling + "[initial]\njoints.hinge = { position = 2.5 }\n" +
                           output("joint_wrench", "load", "joint = \"hinge\"") +
                           output("position", "tip", "link = \"rod\"\nat = [0, 0, -1]");
  const auto s = scene_of(folder, rod, more, 2, "fixed", "extrema = \"all\"\n");
  const auto a = scene::assemble(s);
  const auto whole = scene::run(s, a, into(folder / "whole"));
  auto half = into(folder / "parts");
  half.stop_at = 77;
  EXPECT_TRUE(scene::run(s, a, half).interrupted);
  const auto parts = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(read_bytes(folder / "whole/run.h5"), read_bytes(folder / "parts/run.h5"));
  const auto memory = scene::run_in_memory(s, a, {});
  ASSERT_EQ(whole.outputs.size(), 9u);
  for (size_t k = 0; k < 9; ++k)
    for (const auto* other : {&parts.outputs[k], &memory.outputs[k]}) {
      EXPECT_EQ(whole.outputs[k].name, other->name);
      EXPECT_EQ(whole.outputs[k].largest, other->largest);
      EXPECT_EQ(whole.outputs[k].least, other->least);
      EXPECT_EQ(whole.outputs[k].end, other->end);
    }
  // Without outputs the states are the same bits.
  TemporaryFolder bare;
  const auto plain = scene::run_in_memory(
      scene_of(bare, rod, falling + "[initial]\njoints.hinge = { position = 2.5 }\n"),
      scene::assemble(s), {});
  EXPECT_EQ(plain.final_state.x, whole.final_state.x);
  EXPECT_TRUE(plain.outputs.empty());
}

TEST(Outputs, WhatCannotBeIsRefusedWithItsPlace) {
  EXPECT_TRUE(says(refusal(output("position", "tip", "link = \"rood\"")), "rood"));
  EXPECT_TRUE(says(refusal(output("position", "tip", "link = \"base\"")),
                   "there is no body 'base', the root link is 'foot'"));
  EXPECT_TRUE(says(refusal(output("joint_rate", "r", "joint = \"hing\"")), "hing"));
  EXPECT_TRUE(says(refusal(output("joint_wrench", "r", "joint = \"hing\"")),
                   "the model has no joint 'hing' that moves"));
  EXPECT_TRUE(says(refusal(output("energy", "e", "row = \"heat\"")), "expected one of: kinetic"));
  EXPECT_TRUE(says(refusal(output("altitude", "h", "")), "has no [orbit]"));
  EXPECT_TRUE(says(refusal(output("momentum", "p", "link = \"foot\"")), "does not move"));
  EXPECT_TRUE(says(refusal(output("formula", "f", "formula = \"sqrt(\"")), "is no formula"));
  EXPECT_EQ(refusal(output("formula", "f", "formula = \"2 * pi\"")), "");
  EXPECT_TRUE(says(refusal(output("formula", "f", "formula = \"2 * phi\"")), "is no formula"));
  EXPECT_TRUE(says(refusal(output("formula", "f", "formula = \"a + 1\"")), "no outputs before it"));
  EXPECT_TRUE(says(refusal(output("formula", "f", "formula = \"1, 2\"")), "states 2 numbers"));
  const auto q = output("joint_position", "q", "joint = \"hinge\"");
  EXPECT_TRUE(says(refusal(q + output("formula", "f", "formula = \"q = 5\"")), "assigns by '='"));
  EXPECT_EQ(refusal(q + output("formula", "f", "formula = \"q >= 5 ? 1 : q == 2\"")), "");
  EXPECT_TRUE(says(refusal(output("formula", "f", "formula = \"" + std::string(2000, '(') + "\"")),
                   "has 2000 characters, expected at most 1000"));
  EXPECT_TRUE(says(refusal(output("centre_of_mass", "9a", "")), "not first a digit"));
  const auto com = output("centre_of_mass", "com", "");
  EXPECT_TRUE(says(refusal(com + com), "is that of another output"));
  EXPECT_TRUE(says(refusal(com + output("power", "p", "")), "lacks the key 'row'"));
  EXPECT_TRUE(says(refusal("[[output]]\nquantity = \"heat\"\nname = \"h\"\n"), "expected"));
  EXPECT_TRUE(says(refusal("[[contact]]\nname = \"c\"\nlinks = [\"rod\"]\nstiffness = 1\nwidth = "
                           "0.1\nshape = { kind = \"sphere\", radius = 0.1 }\n" +
                           output("joint_wrench", "r", "joint = \"hinge\"")),
                   "cannot be combined with contact 'c'"));
  for (const auto& text : {refusal(com + output("altitude", "h", "")), refusal(com + com)})
    EXPECT_TRUE(says(text, "scene.toml:")) << "with file and line";
}

TEST(Stops, EndARunAtTheirInstant) {
  TemporaryFolder folder;
  const std::string turning = "[initial]\njoints.hinge = { position = 0, velocity = 2 }\n" +
                              output("joint_position", "q", "joint = \"hinge\"");
  const auto stop = [](const std::string& keys) { return "[[stop]]\noutput = \"q\"\n" + keys; };
  const auto run = [&](const std::string& more) {
    const auto s = scene_of(folder, rod, turning + more, 8);
    return scene::run_in_memory(s, scene::assemble(s), {});
  };
  const auto r = run(stop("above = 7.2512\n"));
  ASSERT_TRUE(r.stopped);
  EXPECT_NEAR(r.stopped->at, 3.6256, 1e-14);  // 0
  EXPECT_EQ(r.simulated_s, r.stopped->at);
  EXPECT_TRUE(r.passed());
  EXPECT_TRUE(says(r.notes.front(), "by the stop 'q above 7.2512'"));
  const auto failed = run(stop("above = 7\noutcome = \"fail\"\nname = \"too far\"\n"));
  EXPECT_EQ(failed.verdict(), scene::Verdict::fail);
  EXPECT_EQ(run(stop("above = 7\nafter = 5\n")).stopped->at, 5);
  const auto never = run(stop("above = 17\n"));
  EXPECT_FALSE(never.stopped);
  EXPECT_EQ(never.simulated_s, 8);
  // The first of two.
  EXPECT_EQ(run(stop("above = 9\n") + stop("above = 3\n")).stopped->name, "q above 3");
}

TEST(Stops, ARefusedOneSaysWhy) {
  const std::string q = "[initial]\njoints.hinge = { position = 1 }\n" +
                        output("joint_position", "q", "joint = \"hinge\"") +
                        output("joint_torque", "tau", "joint = \"hinge\"");
  const auto stop = [&](const std::string& keys) { return refusal(q + "[[stop]]\n" + keys, ""); };
  EXPECT_TRUE(says(stop("output = \"q\"\n"), "has 0 of the keys above and below"));
  EXPECT_TRUE(says(stop("output = \"q\"\nabove = 3\nbelow = 1\n"), "has 2 of the keys"));
  EXPECT_TRUE(says(stop("output = \"p\"\nabove = 3\n"), "expected a number of an [[output]]: q"));
  EXPECT_TRUE(says(stop("output = \"q\"\nabove = 0.5\n"), "holds where the run starts"));
  EXPECT_TRUE(says(refusal(q + "[[element]]\ntype = \"controller\"\njoint = \"hinge\"\nstiffness = "
                               "30\nrate = 10\n[[stop]]\noutput = \"tau\"\nabove = 3\n",
                           ""),
                   "depends on the state alone"));
}

TEST(Stops, WorkWithStepControlEventsAndResume) {
  TemporaryFolder folder;
  // A lock at 1 s; the lower rod goes on and passes the stop.
  const std::string more =
      falling + "[initial]\njoints.shoulder = { position = 2 }\njoints.elbow = { position = 1 }\n" +
      output("joint_position", "q", "joint = \"shoulder\"") +
      output("joint_rate", "rate", "joint = \"elbow\"") +
      "[[stop]]\noutput = \"rate\"\nabove = 1.3\nafter = 1.3\n" +
      "[[event]]\ntype = \"lock\"\njoint = \"shoulder\"\nat = 1\n";
  auto s = scene_of(folder, arm_urdf(), more, 5);
  const auto a = scene::assemble(s);
  const auto r = scene::run(s, a, into(folder / "out"));
  ASSERT_TRUE(r.stopped) << r.outputs[1].least << " to " << r.outputs[1].largest;
  EXPECT_EQ(r.phases, 2);
  EXPECT_LT(r.simulated_s, 5);
  EXPECT_NEAR(r.outputs[1].end, 1.3, 1e-13);
  const auto summary = nlohmann::json::parse(read_bytes(folder / "out/summary.json"));
  EXPECT_EQ(summary.at("stopped_by").at("condition"), "rate above 1.3");
  EXPECT_TRUE(summary.at("outputs").at("q").at("end").is_null());  // locked
  auto broken = into(folder / "parts");
  broken.stop_at = 50;
  EXPECT_TRUE(scene::run(s, a, broken).interrupted);
  const auto again = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(again.final_state.x, r.final_state.x);
  EXPECT_EQ(again.simulated_s, r.simulated_s);
  EXPECT_EQ(read_bytes(folder / "out/phase_2/run.h5"), read_bytes(folder / "parts/phase_2/run.h5"));
  // With a step control the instant agrees with that of small steps.
  const std::string swing = falling + "[initial]\njoints.hinge = { position = 2.5 }\n" +
                            output("joint_position", "q", "joint = \"hinge\"") +
                            "[[stop]]\noutput = \"q\"\nbelow = -1\n";
  s = scene_of(folder, rod, swing, 5);
  const double at = scene::run_in_memory(s, scene::assemble(s), {}).simulated_s;
  s.step_control = integrators::StepControl::reversible;
  s.control_rate = 100;
  EXPECT_NEAR(scene::run_in_memory(s, scene::assemble(s), {}).simulated_s, at, 1e-12);
}

TEST(Stops, InOrbitAnAltitudeAndInEnsemblesTheCasesThatMeetIt) {
  TemporaryFolder folder;
  auto s = shipped(
      folder, "ets_vii_orbit", 400, {},
      output("altitude", "height", "") + "[[stop]]\noutput = \"height\"\nbelow = " + "100000\n");
  const auto a = scene::assemble(s);
  const auto r = scene::run_in_memory(s, a, {});
  EXPECT_FALSE(r.stopped);
  ASSERT_EQ(r.outputs.size(), 1u);
  EXPECT_GT(r.outputs[0].least, 400e3);
  s.stops[0].limit = (r.outputs[0].start + r.outputs[0].end) / 2;
  s.stops[0].above = r.outputs[0].end > r.outputs[0].start;
  const auto ended = scene::run_in_memory(s, a, {});
  ASSERT_TRUE(ended.stopped);
  EXPECT_NEAR(ended.outputs[0].end, s.stops[0].limit, 1e-8);  // roundings of 6.9e6 m

  const std::string more =
      "[initial]\njoints.hinge = { position = 0, velocity = 2 }\n" +
      output("joint_position", "q", "joint = \"hinge\"") + "[[stop]]\noutput = \"q\"\nabove = 3\n" +
      "[ensemble]\ncases = 8\n[ensemble.vary]\n\"initial.joints.hinge.velocity\" = { uniform = "
      "[0.5, 4] }\n";
  const auto cases = scene_of(folder, rod, more, 2);
  scene::EnsembleOptions o;
  o.out = (folder / "ensemble").string();
  o.threads = 1;
  const auto e = scene::run_ensemble(scene::Ensemble(cases), o);
  ASSERT_EQ(e.outputs.size(), 1u);
  ASSERT_EQ(e.stopped.size(), 1u);
  EXPECT_GT(e.stopped[0], 1);
  EXPECT_LT(e.stopped[0], 8);
  EXPECT_LE(e.outputs[0].largest.quantiles[6], 3 + 1e-14);
  EXPECT_LT(e.outputs[0].end.quantiles[0], 3);
}

}  // namespace porthos::test::outputs_test
