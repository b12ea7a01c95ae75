// Slopes of scenes with events: against closed forms and differences of whole runs; controls.
#include <fmt/format.h>

#include <cmath>

#include "scene/sensitivity/event_run.h"
#include "scene/sensitivity/sensitivity.h"
#include "tests/places.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene::event_slopes_test {
namespace {

double slope_of(const EndSensitivity& r, const std::string& of, const std::string& by) {
  const auto quantity = std::ranges::find(r.of, of, &EndSlopes::name);
  const auto input = std::ranges::find(r.inputs, by, &Input::name);
  if (quantity == r.of.end() || input == r.inputs.end()) {
    ADD_FAILURE() << "no " << of << " by " << by;
    return NAN;
  }
  return quantity->slopes[size_t(input - r.inputs.begin())];
}

class EventSlopes : public SceneFiles {
 protected:
  /// A block of 4 kg that catches a body of 1 kg, on the line through both centres.
  Scene catching(const std::string& moment) const {
    write("block.urdf", R"(<robot name="block"><link name="bus"><inertial><mass value="4"/>
<inertia ixx="1" iyy="1.2" izz="0.9" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>)");
    return read(fmt::format(R"([model]
urdf = "block.urdf"
base = "free"
[[body]]
name = "target"
mass = 1.0
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]
position = [1.2, 0, 0]
linear_velocity = [-0.2, 0, 0]
[[event]]
type = "capture"
{}
body = "target"
link = "bus"
on_body = [-0.5, 0, 0]
on_link = [0.5, 0, 0]
[integrator]
method = "gauss8"
step = 0.1
[run]
duration = 3.0
[[output]]
quantity = "position"
name = "bus"
link = "bus"
)",
                            moment));
  }

  /// A floating arm that catches a body as it slows down, whose elbow locks as it bends and is free
  /// again later, and that lets the body go.
  Scene handling(const std::string& events) const {
    const auto link = [](const char* name, double mass) {
      return fmt::format(
          R"(<link name="{}"><inertial><origin xyz="0.3 0.05 0.1"/><mass value="{}"/>
<inertia ixx="{}" iyy="{}" izz="{}" ixy="0.02" ixz="0.01" iyz="-0.03"/></inertial></link>)",
          name, mass, 0.2 * mass, 0.25 * mass, 0.3 * mass);
    };
    const auto joint = [](const char* name, const char* parent, const char* child,
                          const char* axis) {
      return fmt::format(R"(<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>
<origin xyz="0.6 0 0.1"/><axis xyz="{}"/><limit effort="9" velocity="9"/></joint>)",
                         name, parent, child, axis);
    };
    write("arm.urdf", fmt::format(R"(<robot name="arm">{}{}{}{}{}{}{}</robot>)", link("bus", 20),
                                  link("upper", 3), link("lower", 2), link("hand", 1),
                                  joint("shoulder", "bus", "upper", "0 1 0"),
                                  joint("elbow", "upper", "lower", "0 0.6 0.8"),
                                  joint("wrist", "lower", "hand", "1 0 0")));
    return read(fmt::format(R"([model]
urdf = "arm.urdf"
base = "free"
[initial]
base = {{ angular_velocity = [0.02, -0.03, 0.05] }}
joints.shoulder = {{ position = 0.2, velocity = 0.3 }}
joints.elbow = {{ position = -0.1, velocity = 0.4 }}
joints.wrist = {{ velocity = -0.2 }}
[[body]]
name = "target"
mass = 4.0
inertia = [0.4, 0.5, 0.6, 0.02, 0.0, 0.03]
position = [2.2, 0.2, 0.1]
linear_velocity = [-0.05, 0.02, 0.01]
angular_velocity = [0.1, -0.2, 0.05]
[[element]]
name = "spring"
type = "spring"
joint = "shoulder"
stiffness = 8.0
[[element]]
name = "brake"
type = "damper"
joint = "shoulder"
damping = 1.0
{}[integrator]
method = "gauss12"
step = 0.1
[run]
duration = 3.5
[[output]]
quantity = "position"
name = "hand"
link = "hand"
[[output]]
quantity = "velocity"
name = "target_rate"
link = "target"
)",
                            events));
  }
};

/// From 1 s to 3 s the block moves at u = m v/(M + m).
TEST_F(EventSlopes, OfACaptureAreItsClosedForm) {
  const double M = 4, m = 1, v = -0.2, u = m * v / (M + m), per_mass = v * M / ((M + m) * (M + m));
  const auto at_time = end_sensitivity(catching("at = 1.0\nreach = 0.1"), {.of = {"bus.x"}});
  ASSERT_EQ(at_time.failure, "");
  EXPECT_NEAR(at_time.of[0].value, 2 * u, 1e-14);
  EXPECT_NEAR(slope_of(at_time, "bus.x", "target.mass"), 2 * per_mass, 1e-13);
  EXPECT_NEAR(slope_of(at_time, "bus.x", "target.linear_velocity.x"), 2 * m / (M + m), 1e-13);
  EXPECT_NEAR(slope_of(at_time, "bus.x", "target.position.x"), 0, 1e-13);
  EXPECT_NEAR(slope_of(at_time, "bus.x", "event[0].at"), -u, 1e-13);
  // Caught at a gap of 0.12 m, at (0.2 - reach)/-v: places, speeds and the reach move the instant.
  const auto near = end_sensitivity(catching("when = \"within_reach\"\nreach = 0.12\nspeed = 1\n"
                                             "rate = 1"),
                                    {.of = {"bus.x"}});
  ASSERT_EQ(near.failure, "");
  const double t = (0.2 - 0.12) / -v;
  EXPECT_NEAR(near.of[0].value, u * (3 - t), 1e-14);
  EXPECT_NEAR(slope_of(near, "bus.x", "target.mass"), per_mass * (3 - t), 1e-13);
  EXPECT_NEAR(slope_of(near, "bus.x", "target.position.x"), u / v, 1e-13);
  EXPECT_NEAR(slope_of(near, "bus.x", "event[0].reach"), -u / v, 1e-13);
  EXPECT_NEAR(slope_of(near, "bus.x", "target.linear_velocity.x"),
              m / (M + m) * (3 - t) - u * t / -v, 1e-13);
}

constexpr const char* unlock = "[[event]]\ntype = \"unlock\"\nat = 2.0\njoint = \"elbow\"\n";
constexpr const char* letting_go = "[[event]]\ntype = \"release\"\nat = 2.5\nbody = \"target\"\n";
std::string lock(const std::string& more = "") {
  return "[[event]]\ntype = \"lock\"\njoint = \"elbow\"\nabove = 0.05\n" + more;
}
std::string capture(double speed) {
  return fmt::format(R"([[event]]
type = "capture"
when = "within_reach"
body = "target"
link = "hand"
on_body = [-0.3, 0, 0]
on_link = [0.1, 0, 0]
reach = 2.0
speed = {}
rate = 9.0
)",
                     speed);
}

/// The largest difference of the slopes from those by differences of runs, in what these allow.
double worst_of(const Scene& s, std::vector<std::string> by) {
  const std::vector<std::string> of = {"hand.x", "target_rate.y", "base.attitude.z",
                                       "elbow.velocity", "energy"};
  const auto r = end_sensitivity(s, {.of = of}), runs = end_sensitivity(s, {.of = of, .by = by});
  EXPECT_EQ(r.failure + runs.failure, "");
  double worst = 0, off = 0;
  for (const auto& q : runs.of)
    for (size_t i = 0; i < runs.inputs.size(); ++i) {
      std::string name = runs.inputs[i].name;
      if (!name.starts_with("event"))
        for (const auto& [from, to] : {std::pair{"[0]", ".x"}, {"[1]", ".y"}})
          if (name.ends_with(from)) name.replace(name.size() - 3, 3, to);
      const double apart = std::fabs(slope_of(r, q.name, name) - q.slopes[i]),
                   may = 3 * q.errors[i] + 1e-11 * (1 + std::fabs(q.slopes[i]));
      EXPECT_LE(apart, may) << q.name << " by " << name << " = " << q.slopes[i];
      off = std::max(off, apart);
      worst = std::max(worst, apart / may);
    }
  std::printf("  off by %.1e at most, %.2g of what the differences allow\n", off, worst);
  return worst;
}

/// A lock at an angle, a capture as the speed falls, which depends on the place of the lock and on
/// the masses, an unlocking and a release.
TEST_F(EventSlopes, OfAChainOfEventsAreDifferencesOfRuns) {
  EXPECT_LE(
      worst_of(handling(unlock + capture(0.25) + lock() + letting_go),
               {"bus.mass", "upper.com.z", "hand.inertia.xy", "target.mass", "target.position[1]",
                "target.angular_velocity[0]", "elbow.velocity", "shoulder.velocity", "event[0].at",
                "event[1].speed", "event[2].above", "event[3].at"}),
      1);
}

/// The lock slows the hand down, so that the capture is at the same instant; and a lock that waits
/// for a time, after the capture.
TEST_F(EventSlopes, OfEventsAtOneInstantAndAfterATime) {
  EXPECT_LE(worst_of(handling(unlock + capture(0.4) + lock() + letting_go),
                     {"lower.mass", "target.position[1]", "elbow.position", "event[2].above"}),
            1);
  EXPECT_LE(
      worst_of(handling(unlock + capture(0.25) + lock("after = 1.25\n") + letting_go),
               {"hand.mass", "target.linear_velocity[0]", "elbow.velocity", "event[2].after"}),
      1);
}

/// Controls: an instant that does not move, and a place of the lock that the mechanism does not
/// know, are visibly wrong.
TEST_F(EventSlopes, NeedTheInstantAndThePlace) {
  Scene s = handling(lock());
  s.centre_stays = true;
  const Assembly a = assemble(s);
  const EventRun run(s, a, "", nullptr);
  ASSERT_EQ(run.phases().size(), 2U);
  EXPECT_EQ(run.inputs().at(0).name, "event[0].above");
  const auto asked = size_t(run.last().mechanism->coordinate("shoulder").q),
             by = size_t(a.mechanism->nq() + a.mechanism->coordinate("elbow").q);
  const integrators::EventObjective end{.end = [&](double, auto x, auto gradient) {
    gradient[asked] = 1;
    return x[asked];
  }};
  const auto slopes = [&](const std::vector<integrators::RunPhase>& phases) {
    const auto g =
        integrators::gradient_across_events(s.method, phases, a.initial, s.step, s.duration, end);
    EXPECT_EQ(g.remark, "");
    const auto at = std::ranges::find(g.names, "event[0].above") - g.names.begin();
    const double by_above = at < long(g.names.size()) ? g.parameters[size_t(at)] : NAN;
    return std::pair{g.start[by], by_above};
  };
  const auto right = slopes(run.phases());
  auto phases = run.phases();
  phases[1].model = run.last().model.get();
  const auto no_place = slopes(phases);
  phases = run.phases();
  phases[0].events[0].at =
      integrators::gradient_across_events(s.method, phases, a.initial, s.step, s.duration, end)
          .events.at(0)
          .t;
  phases[0].events[0].guard = {};
  const auto no_instant = slopes(phases);
  std::printf("  by a momentum %.4f, by the angle %.4f; instant kept %.4f; no place %.4f\n",
              right.first, right.second, no_instant.first, no_place.second);
  EXPECT_GT(std::fabs(no_instant.first - right.first), 1e-3 * std::fabs(right.first));
  EXPECT_GT(std::fabs(no_place.second - right.second), 1e-2 * std::fabs(right.second));
}

/// What has no slopes is named.
TEST_F(EventSlopes, TellWhatNeverHappened) {
  Scene s = catching("when = \"within_reach\"\nreach = 0.05\nspeed = 1\nrate = 1");
  s.duration = 0.5;
  const auto r = end_sensitivity(s, {.of = {"bus.x"}});
  ASSERT_EQ(r.failure, "");
  ASSERT_EQ(r.notes.size(), 1U);
  EXPECT_EQ(r.notes[0],
            "it never happened, and the slopes are of runs without it: capture of target by bus");
  EXPECT_NEAR(slope_of(r, "bus.x", "base.linear_velocity.x"), 0.5, 1e-14);
}

TEST_F(EventSlopes, RefuseWhatHasNone) {
  const auto refused = [&](const Scene& s) {
    const auto text = refusal([&] { (void)end_sensitivity(s, {}); });
    return text.substr(0, text.find("; --by "));
  };
  EXPECT_EQ(refused(catching("when = \"within_reach\"\nreach = 0.3")),
            "scene.toml: a gradient across events takes no [[event]] that happens at the start");
  Scene s = catching("at = 1.0\nreach = 0.1");
  s.method = "gonzalez";
  EXPECT_NE(refused(s).find("has no derivative by the size of its steps"), std::string::npos)
      << refused(s);
  s = read(handling(lock()).text + R"([[element]]
type = "controller"
joint = "wrist"
stiffness = 1
rate = 10
)");
  EXPECT_EQ(refused(s),
            "a gradient across events takes no sampled controllers, and 'arm' has "
            "'wrist.controller'");
  s = catching("at = 1.5\nreach = 0.001");
  EXPECT_NE(refused(s).find("the distance is"), std::string::npos) << refused(s);
  s = handling(lock());
  s.step_control = integrators::StepControl::reversible;
  EXPECT_EQ(refused(s), "scene.toml: a gradient across events takes steps of one size");
}

}  // namespace
}  // namespace porthos::scene::event_slopes_test
