// Scenes with friction of rigid contacts: the example, step controls and monitors, resumed runs,
// and what is refused.
#include <fmt/format.h>

#include "integrators/core/integrator.h"
#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::rigid_friction_run_test {
namespace {

scene::RunReport run_of(const scene::Scene& s) {
  return scene::run_in_memory(s, scene::assemble(s), {});
}
scene::Scene draw_shot(const TemporaryFolder& folder, double duration,
                       std::vector<Change> changes = {}, const std::string& more = "") {
  return shipped(folder, "billiards", duration, changes, more);
}
double apart(const scene::RunReport& a, const scene::RunReport& b) {
  double off = 0;
  for (size_t i = 0; i < a.final_state.x.size(); ++i)
    off = std::max(off, std::fabs(a.final_state.x[i] - b.final_state.x[i]));
  return off;
}

/// The draw shot: both balls roll in the end, the cue ball backwards; what the red one loses by
/// sliding follows from its start. The motion depends neither on the method nor on the control of
/// the steps nor on what watches. Control: without friction the cue ball does not come back.
TEST(RigidFrictionRun, ADrawShot) {
  TemporaryFolder folder;
  const auto r = run_of(draw_shot(folder, 3));
  EXPECT_TRUE(r.passed());
  const auto& x = r.final_state.x;  // position and attitude of both, then momenta
  const double m = 0.17, cue = x[14] / m, red = x[21] / m;
  fmt::print(
      "  cue {:.4f} m/s, red {:.4f} m/s; {:.6f} and {:.6f} J by sliding; energy {:.1e}; {} "
      "impacts\n",
      cue, red, entry_of(r.losses, "cue_on_cloth.friction"),
      entry_of(r.losses, "red_on_cloth.friction"), value_of(r, "energy"), r.impacts[2].count);
  EXPECT_LT(cue, -0.1);
  EXPECT_GT(red, 0.5);
  EXPECT_EQ(r.impacts[2].count, 1);
  // The red ball starts without spin: it slides with all of its velocity, of which 1/(1 + k) stays,
  // k = I/(m r²).
  const double k = 5.5524e-5 / (m * 0.028575 * 0.028575);
  const double first = (1 + k) * std::hypot(red, x[22] / m);
  EXPECT_NEAR(entry_of(r.losses, "red_on_cloth.friction"), 0.5 * m * k / (1 + k) * first * first,
              1e-14);

  for (const std::string more :
       {"step_control = \"time_transformed\"", "step_control = \"reversible\"",
        "[monitor]\nlimit = 1e-12\naction = \"stop\"", "[monitor]\nproject = true",
        "[monitor]\nstep_limit = 1e-12\naction = \"repeat\""}) {
    TemporaryFolder other;
    const auto s = run_of(draw_shot(other, 3, {{"step = 0.01", "step = 0.01\n" + more + "\n"}}));
    // These stop at whole steps of their own: the balls roll on for a part of one.
    const bool whole = more[0] == '[';
    const double off = whole ? apart(r, s) : std::fabs(s.final_state.x[14] / m - cue);
    fmt::print("  {:50.50} energy {:.1e}, {} off by {:.1e}   bound 1e-10\n",
               more.substr(0, more.find('\n', 12)), value_of(s, "energy"),
               whole ? "state" : "velocity", off);
    EXPECT_TRUE(s.passed()) << more;
    EXPECT_LE(off, 1e-10) << more;
  }
  {
    TemporaryFolder other;
    const auto s = run_of(draw_shot(other, 3, {{"\"gauss16\"", "\"gauss8\""}}));
    fmt::print("  gauss8: state off by {:.1e}   bound 1e-8\n", apart(r, s));
    EXPECT_LE(apart(r, s), 1e-8);
  }
  {  // It sees the efforts of its mean: the losses are those of the same friction.
    TemporaryFolder other;
    const auto s = run_of(draw_shot(other, 3, {{"\"gauss16\"", "\"mean_value\""}}));
    fmt::print("  mean_value: energy {:.1e}   bound 1e-13\n", value_of(s, "energy"));
    EXPECT_LE(value_of(s, "energy"), 1e-13);
  }
  TemporaryFolder smooth;
  const auto without =
      run_of(draw_shot(smooth, 3, {{"friction = 0.2", ""}, {"friction = 0.2", ""}}));
  EXPECT_GT(without.final_state.x[14], 0);
}

/// Interrupted while both slide, while one rolls, and when both do, and continued: the same bits.
TEST(RigidFrictionRun, AResumedRunHasTheSameBits) {
  TemporaryFolder folder;
  expect_same_bits_when_resumed(folder, draw_shot(folder, 3), {13, 26, 40, 77, 250});
}

TEST(RigidFrictionRun, RefusalsSayWhereAndWhat) {
  const auto refusal = [](const std::vector<Change>& changes, const std::string& more = "") {
    return refusal_of_scene(
        [&](const TemporaryFolder& folder) { return draw_shot(folder, 1, changes, more); });
  };
  const auto refused = [](const std::string& text, const std::string& expected) {
    EXPECT_TRUE(text.starts_with("scene.toml:") && says(text, expected)) << text;
  };
  refused(refusal({{"friction = 0.2", "friction = 0.2\ncreep = 0.1"}}),
          "creep is given with law = \"rigid\", which sticks");
  refused(refusal({{"friction = 0.2", "friction = -0.2"}}), "friction is -0.2");
  refused(refusal({{"friction = 0.2", "friction = 0.2\nsimultaneous = \"moreau\""}}),
          "simultaneous is given with friction, whose impacts come one after another");
  refused(
      refusal({{"shape = { kind = \"sphere\", radius = 0.028575 }",
                "shape = { kind = \"box\", size = [0.05, 0.05, 0.05] }"}}),
      "a box and a plane touch in 8 points and have friction, expected shapes that touch in one");
  refused(refusal({{"restitution = 0.95", "restitution = 0.95\nfriction = 0.05"}}),
          "a link of it has rigid friction at another point, in 'cue_on_cloth', expected one such "
          "point on a link");
}

}  // namespace
}  // namespace porthos::test::rigid_friction_run_test
