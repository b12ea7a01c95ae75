// Slopes of scenes under a step control: of the run itself, and those that steps of one size have.
#include <cmath>

#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/sensitivity.h"
#include "scene/session/memory_run.h"
#include "tests/scene/scene_files.h"

namespace porthos::scene::kept_steps_test {
namespace {

constexpr const char* sentence =
    "the steps are those of the run; their own change is not in the derivative, of the order of "
    "the method's error";

class KeptSteps : public SceneFiles {
 protected:
  /// The arm on a bus that stands, falling; the run has no whole number of steps.
  Scene arm(const std::string& method, const std::string& control) const {
    return read(R"([model]
urdf = "arm.urdf"
base = "fixed"
inertia.lower = { mass = 2, com = [0.1, 0, 0.2], inertia = [1, 2, 2.5, 0.1, 0.2, 0.3] }
[environment]
gravity = "uniform"
vector = [0, 0.5, -9.81]
[initial]
joints.shoulder = { position = 0.3, velocity = -0.05 }
[[element]]
type = "spring"
name = "coil"
joint = "slide"
stiffness = 300
[integrator]
method = ")" + method +
                "\"\nstep = 0.02\n" + control + "[run]\nduration = 1.503\n");
  }
};

const SensitivityRequest of_both{.of = {"shoulder.position", "slide.velocity"}};

const std::string reversible = "step_control = \"reversible\"\nstep_control_rate = 2\n",
                  transformed = "step_control = \"time_transformed\"\nstep_control_rate = 2\n";

double largest_apart(const EndSensitivity& a, const EndSensitivity& b) {
  double apart = 0, size = 0;
  for (size_t q = 0; q < a.of.size(); ++q)
    for (size_t i = 0; i < a.inputs.size(); ++i) {
      apart = std::max(apart, std::fabs(a.of[q].slopes[i] - b.of[q].slopes[i]));
      size = std::max(size, std::fabs(b.of[q].slopes[i]));
    }
  return apart / size;
}

TEST_F(KeptSteps, AreThoseOfTheRun) {
  for (const char* method : {"gauss8", "kahan_li6"}) {
    const Scene s = arm(method, reversible);
    const Assembly a = assemble(s);
    const auto ran = run_in_memory(s, a, {.judge = false});
    const auto r = end_sensitivity(s, of_both);
    ASSERT_EQ(r.failure, "");
    EXPECT_EQ(r.of[0].value, ran.final_state.x[0] + 2 * M_PI * double(ran.final_state.turns[0]));
    EXPECT_EQ(r.chosen, ran.steps);
    EXPECT_GT(r.chosen, 80);  // 76 of one size
    EXPECT_EQ(r.notes, std::vector<std::string>{sentence});
    const auto plain = end_sensitivity(arm(method, ""), of_both);  // control
    EXPECT_NE(r.of[0].value, plain.of[0].value);
    EXPECT_TRUE(plain.notes.empty());
  }
}

/// The slopes of the motion itself, where both runs are at rounding. Control: a method of order 2.
TEST_F(KeptSteps, HaveTheSlopesOfStepsOfOneSize) {
  for (const auto& control : {reversible, transformed}) {
    const auto apart = [&](const char* method) {
      return largest_apart(end_sensitivity(arm(method, control), of_both),
                           end_sensitivity(arm(method, ""), of_both));
    };
    const double fine = apart("gauss16"), coarse = apart("midpoint");
    std::printf("  gauss16: %.1e of the largest (bound 1e-11), midpoint: %.1e\n", fine, coarse);
    EXPECT_LT(fine, 1e-11);
    EXPECT_GT(coarse, 1e-5);
  }
}

TEST_F(KeptSteps, OfATransformedTimeTellHowFarOffTheyAre) {
  const auto r = end_sensitivity(arm("gauss4", transformed), of_both);
  ASSERT_EQ(r.notes.size(), 2U);
  EXPECT_EQ(r.notes[0], sentence);
  EXPECT_EQ(r.notes[1].find("time_transformed takes these steps in another time: the slopes are of "
                            "gauss4 at the same steps, whose end is off the run's by "),
            0U)
      << r.notes[1];
}

/// A control that cannot go on: rho becomes negative.
TEST_F(KeptSteps, TellARunThatFails) {
  Scene s = arm("gauss8", reversible);
  s.step = 3;
  s.duration = 100;
  const auto r = end_sensitivity(s, of_both);
  EXPECT_EQ(r.failure.find("the step at t = "), 0U) << r.failure;
  EXPECT_TRUE(r.of.empty());
}

TEST_F(KeptSteps, StopWithTheRun) {
  const std::atomic<bool> stop = true;
  SensitivityRequest request = of_both;
  request.stop = &stop;
  EXPECT_EQ(end_sensitivity(arm("gauss8", reversible), request).failure, "the run was stopped");
}

}  // namespace
}  // namespace porthos::scene::kept_steps_test
