// Gain sweeps over lanes and threads.
#include "energy_shaping/certify/sweep.h"

#include <chrono>
#include <cstdlib>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/run.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "tests/energy_shaping/robots.h"

namespace porthos::energy_shaping::sweep_test {
namespace {

using test::agrees, test::breaks, test::keeps, test::refusal, test::Vec;

TEST(Sweep, IsTheRunsOneByOne) {
  const auto loop = acrobot({});
  SweepOptions o{.start = {0.1, 0, 0, 0}, .duration = 20, .step = 0.01, .threads = 2};
  const auto gains = grid_of({{150, 200, 250}, {1, 2, 4, 8}});  // 12: a last pack half full
  const auto results = sweep(*loop, gains, o);
  o.threads = 1;
  const auto alone = sweep(*loop, gains, o);
  for (size_t i = 0; i < gains.size(); ++i) {
    EXPECT_EQ(results[i].residual, alone[i].residual)
        << "any number of threads gives the same bits";
    const auto one = acrobot({.ku = gains[i][0], .kv = gains[i][1]});
    const auto run = simulate(*one, o.start, {.duration = 20, .step = 0.01});
    const double rest = one->instantiate<double>()->hamiltonian(one->rest());
    agrees("residual of H_d", results[i].residual, (run.H.back() - rest) / (run.H.front() - rest),
           1e-4);
    agrees("largest input", results[i].peak, run.peak[0], 1e-5);
  }
  const int best = fastest(results, 1e9);
  ASSERT_GE(best, 0);
  for (const auto& r : results) EXPECT_LE(results[size_t(best)].settling, r.settling);
  EXPECT_EQ(fastest(results, 1e-3), -1) << "no run has so small a torque";
}

/// Against runs of the plant, whose limits act there. Control: without limits they are passed.
TEST(Sweep, TorquesStayWithinTheirLimits) {
  const auto loop = acrobot({});
  const auto gains = grid_of({{150, 250}, {1, 8}});
  SweepOptions o{.start = {0.1, 0, 0, 0}, .duration = 5, .step = 0.01, .threads = 1};
  const auto free = sweep(*loop, gains, o);
  o.limits = {0.3 * free[0].peak};
  const auto results = sweep(*loop, gains, o);
  for (size_t i = 0; i < gains.size(); ++i) {
    const auto one = acrobot({.ku = gains[i][0], .kv = gains[i][1]});
    const auto run =
        simulate(*one, o.start, {.duration = 5, .step = 0.01, .method = "rk4", .limits = o.limits});
    EXPECT_GT(free[i].peak, o.limits[0]);
    EXPECT_EQ(results[i].peak, o.limits[0]);
    const double rest = one->instantiate<double>()->hamiltonian(one->rest());
    agrees("H_d left", results[i].residual, (run.H.back() - rest) / (run.H.front() - rest), 1e-4);
  }
  o.limits = {1, 1};
  EXPECT_NE(refusal([&] { (void)sweep(*loop, gains, o); }), "");
}

/// An inertia wheel that turns over under its limit comes down at another minimum of H_d, a turn
/// away: it has not settled. Control: a larger limit.
TEST(Sweep, AnotherMinimumIsNotTheRest) {
  const auto d = inertia_wheel_gains({.I1 = 0.015, .I2 = 3e-4, .m3 = 0.55}, 5, 0.8);
  const auto loop = inertia_wheel_pendulum(d);
  const auto tried = [&](double limit) {
    SweepOptions o{.start = {1.2, 0, 0, 0}, .duration = 20, .step = 0.0025, .threads = 1};
    o.limits = {limit};
    const auto r = sweep(*loop, {{d.k1, d.kv}}, o)[0];
    std::printf("  limit %g: settled in %.3g s, H_d left %.1e, elsewhere %d\n", limit, r.settling,
                r.residual, r.elsewhere);
    EXPECT_LT(r.residual, o.settled);
    EXPECT_EQ(std::isfinite(r.settling), !r.elsewhere);
    return r.elsewhere;
  };
  EXPECT_TRUE(tried(0.8));
  EXPECT_FALSE(tried(8));
}

/// A fast motion of a loop takes steps in parts: twenty times the damping at a step of 0.01 s.
/// Control: one step of Runge and Kutta cannot be that long; a motion that is faster still is
/// refused.
TEST(Sweep, FastGainsTakeTheirStepInParts) {
  auto d = inertia_wheel_gains({.I1 = 0.015, .I2 = 3e-4, .m3 = 0.55}, 5, 0.8);
  d.kv *= 20;
  const auto loop = inertia_wheel_pendulum(d);
  const Vec start{0.3, 0, 0, 0};
  double fastest = 0;
  for (const auto& each : phs::spectrum(4, field_jacobian(*loop, loop->rest())).rest)
    fastest = std::max(fastest, std::abs(each));
  breaks("fastest motion times the step, of a stable step 2.8", fastest * 0.01, 2.8);
  const SweepOptions o{.start = start, .duration = 20, .step = 0.01, .threads = 1};
  const auto swept = sweep(*loop, {{d.k1, d.kv}}, o)[0];
  const auto run = simulate(*loop, start, {.duration = 20, .step = 0.001});
  EXPECT_TRUE(swept.finite);
  agrees("largest input", swept.peak, run.peak[0], 1e-3);
  const auto why = refusal([&] { (void)sweep(*loop, {{d.k1, 1e9 * d.kv}}, o); });
  EXPECT_NE(why.find("expected steps of at most"), why.npos) << why;
  EXPECT_LE(why.size(), 220u);
}

TEST(Sweep, Refuses) {
  const auto loop = acrobot({});
  EXPECT_NE(refusal([&] { (void)sweep(*loop, {{1}}, {.start = {0, 0, 0, 0}}); }), "");
  EXPECT_NE(refusal([&] { (void)sweep(*loop, {{200, 1}}, {.start = {0, 0}}); }), "");
}

TEST(Sweep, TenThousandAcrobotsLONG) {
  if (!std::getenv("PORTHOS_LONG")) GTEST_SKIP() << "10 000 runs: set PORTHOS_LONG=1";
  const auto loop = acrobot({});
  EXPECT_THROW((void)logarithmic(-1, 10, 3), InvalidArgument);
  const auto gains = grid_of({logarithmic(80, 800, 100), logarithmic(0.3, 30, 100)});
  const auto before = std::chrono::steady_clock::now();
  const auto results =
      sweep(*loop, gains, {.start = {0.2, 0, 0, 0}, .duration = 20, .step = 0.01, .threads = 2});
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  int settled = 0;
  for (const auto& r : results) settled += std::isfinite(r.settling);
  const int best = fastest(results, 100);
  ASSERT_GE(best, 0);
  std::printf("  %d of %zu settle; fastest with |u| <= 100: ku %.0f, kv %.2f, %.2f s, |u| %.1f\n",
              settled, results.size(), results[size_t(best)].gains[0],
              results[size_t(best)].gains[1], results[size_t(best)].settling,
              results[size_t(best)].peak);
  keeps("wall-clock [s]", seconds, 60);
}

TEST(DesignHelp, BandwidthAndDampingRatio) {
  const auto model = test::ets_vii_model(false);
  Vec rest = model->mechanism().neutral();
  const PotentialLoop loop(model, joint_regulation(*model, rest, 0.2, 0.8));
  // One joint alone would have exactly ω and ζ; coupled, all six modes are near.
  int modes = 0;
  for (const auto& l : phs::eigenvalues(26, field_jacobian(loop, loop.rest()))) {
    if (std::abs(l) < 1e-3) continue;  // the floating base
    ++modes;
    EXPECT_LT(l.real(), 0);
  }
  EXPECT_EQ(modes, 12);
  const auto one = test::arm(1, 0, 0);
  const PotentialLoop single(one, joint_regulation(*one, {0.0}, 3, 0.5));
  const auto e = phs::eigenvalues(2, field_jacobian(single, single.rest()));
  agrees("|λ|", std::abs(e[0]), 3, 1e-12);
  agrees("damping ratio", -e[0].real() / 3, 0.5, 1e-12);
}

/// A joint is left out by the name of its port or its own; what is neither is refused, not ignored.
TEST(DesignHelp, SkipsJointsByTheirNames) {
  const auto arm = test::arm(3, 0, 0);
  const Vec rest(3, 0.1);
  const auto driven = [&](const std::vector<std::string>& skip) {
    return joint_regulation(*arm, rest, 3, 0.5, skip).actuators;
  };
  const std::vector<std::string> two{"joint_0.torque", "joint_1.torque"};
  EXPECT_EQ(driven({"joint_2.torque"}), two);
  EXPECT_EQ(driven({"joint_2"}), two);
  EXPECT_EQ(driven({}).size(), 3u);  // control
  for (const char* wrong : {"nonsense", "joint_", "torque", ""}) try {
      (void)driven({"joint_2", wrong});
      ADD_FAILURE() << wrong;
    } catch (const InvalidArgument& e) {
      const std::string what = e.what();
      EXPECT_NE(what.find(std::string("skip '") + wrong + "'"), what.npos) << what;
      EXPECT_NE(what.find("of: joint_0.torque, joint_1.torque, joint_2.torque"), what.npos) << what;
    }
  const auto six = test::arm(6, 0, 0);
  const auto text = refusal([&] { (void)joint_regulation(*six, Vec(6), 3, 0.5, {"join_5"}); });
  EXPECT_NE(text.find("as 'joint_5.torque', the nearest"), text.npos) << text;
}

/// Nothing cancels a spring at a joint without actuator: refused with compensation. Controls: the
/// spring kept in H_d, no spring, and the same spring wanted there.
TEST(DesignHelp, ASpringAtASkippedJointIsNotCompensated) {
  const auto told = [](double spring, bool compensate, double wanted = 0, double rest = 0) {
    const auto arm = test::arm(3, 0, 0, spring);
    auto s = joint_regulation(*arm, {0.1, 0.1, rest}, 3, 0.5, {"joint_2"});
    s.compensate = compensate;
    if (wanted > 0) s.joints.push_back({"joint_2.torque", wanted, 0});
    return refusal([&] {
      const PotentialLoop loop(arm, s);
      Region region;
      region.lower.assign(3, -1);
      region.upper.assign(3, 1);
      const auto c = certify(loop, {.region = region});
      keeps("H_d'", c.item("H_d' = -∂H_dᵀ R_d ∂H_d").value, 1e-12);
      // without a spring the certificate tells what helps
      EXPECT_EQ(c.has("joints that nothing holds"), spring == 0 || compensate);
      if (spring == 0) {
        EXPECT_NE(c.item("joints that nothing holds").text.find("JointSpec(stiffness=), with comp"),
                  std::string::npos);
      }
    });
  };
  const auto why = told(2, true);
  EXPECT_NE(why.find("joint 'joint_2' needs a force no actuator provides: drive it"), why.npos)
      << why;
  EXPECT_NE(
      why.find("or keep its spring, 2 (gravity = \"keep\", in programs compensate = false); "),
      why.npos)
      << why;
  const auto beside = told(2, true, 0, 0.3);  // of a rest at which the spring pulls
  EXPECT_NE(beside.find("choose a rest at which its spring, 2, has no force, with gravity = "
                        "\"keep\" (in programs compensate = false), or drive it"),
            why.npos)
      << beside;
  EXPECT_EQ((why + beside).find("constant"), why.npos) << "there is no gravity to balance";
  EXPECT_EQ(told(2, false), "");
  EXPECT_EQ(told(0, true), "");
  EXPECT_NE(told(2, true, 1.9), "");
}

}  // namespace
}  // namespace porthos::energy_shaping::sweep_test
