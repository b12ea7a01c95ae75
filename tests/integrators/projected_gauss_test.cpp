// Rolling bodies: projected Gauss methods against closed forms and references; their order, energy
// and manifold.
#include <gtest/gtest.h>

#include <cmath>

#include "integrators/control/step_control.h"
#include "integrators/methods/projected_gauss.h"
#include "phs/system/reactions.h"
#include "tests/integrators/problems.h"
#include "tests/support/reference.h"
#include "tests/support/rollers.h"

namespace porthos::integrators::projected_gauss_test {
namespace {

using phs::Quad;
using test::Linkage;
using test::Vec;

double number(const nlohmann::json& text) { return std::stod(text.get<std::string>()); }

using Quads = std::vector<Quad>;

/// The state after some steps in 113 bits.
Quads end_of(const std::string& method, const phs::Model& model, const Quads& x, Quad h,
             int steps) {
  phs::BasicState<Quad> s(model.description(), x);
  const auto by = make_basic_integrator<Quad>(method, model, h);
  for (int i = 0; i < steps; ++i) EXPECT_EQ(by->step(s), Outcome::ok);
  for (size_t k = 0; k < s.x.size(); ++k) s.x[k] += s.lo[k];
  return s.x;
}
/// The order of pgauss methods of 1 to `most` stages over 1/2 s.
void expect_orders(Linkage l, int coarse, int most, const std::string& reference) {
  const auto model = l.model();
  const Vec x0 = l.start();
  // A step ends on the manifold to 113 bits.
  const Quads x = end_of("pgauss16", model, Quads(x0.begin(), x0.end()), Quad(1) / 1024, 1);
  const Quads exact = end_of(reference, model, x, Quad(0.5) / 96, 96);
  const auto error = [&](const std::string& method, int steps) {
    const Quads end = end_of(method, model, x, Quad(0.5) / steps, steps);
    double largest = 0;
    for (size_t k = 0; k < exact.size(); ++k)
      largest = std::max(largest, double(phs::abs(end[k] - exact[k])));
    return largest;
  };
  for (int s = 1; s <= most; ++s) {
    const std::string name = "pgauss" + std::to_string(2 * s);
    const double first = error(name, coarse), second = error(name, 2 * coarse);
    const double order = std::log2(first / second);
    std::printf("  %s of %s: errors %.2e, %.2e, order %.2f\n", name.c_str(),
                model.description().name.c_str(), first, second, order);
    EXPECT_NEAR(order, 2 * s, 0.25);
  }
}
TEST(Rolling, OrderIsTwiceTheStages) {
  expect_orders(test::sleigh(), 8, 4, "pgauss16");
  expect_orders(test::rolling_disk(1.25, {0.5, 1, -6}), 32, 2, "pgauss16");
  expect_orders(test::four_bar("spherical"), 48, 2, "spark16");  // positions to bring back
}

TEST(Rolling, SleighFollowsItsClosedForm) {
  const auto reference = test::read_json(test::data_file("reference/q_chaplygin_sleigh.json"));
  auto l = test::sleigh();
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  phs::Reactions reactions(model);
  const double h = 1. / 64;
  const auto by = make_integrator("pgauss16", model, h);
  const auto &x = l.mechanism->coordinate("ice.x"), &y = l.mechanism->coordinate("ice.y"),
             &turn = l.mechanism->coordinate("ice.angle");
  double off = 0, force_off = 0;
  for (const auto& out : reference["outputs"]) {
    while (s.time(h) < number(out["t"]) - h / 2) ASSERT_EQ(by->step(s), Outcome::ok);
    ASSERT_NEAR(s.time(h), number(out["t"]), 1e-12);
    off = std::max({off, std::fabs(s.x[size_t(x.q)] - number(out["x"])),
                    std::fabs(s.x[size_t(y.q)] - number(out["y"])),
                    std::fabs(s.x[size_t(turn.q)] - number(out["theta"]))});
    reactions.at(s.time(h), s.x, s.turns);
    const auto w = reactions.exerted();
    const double heading = number(out["theta"]);
    const double lateral = w[4] * std::cos(heading) - w[3] * std::sin(heading);
    force_off = std::max(force_off, std::fabs(lateral - number(out["lateral_force"])));
  }
  std::printf("  coordinates off by %.1e (m, rad)   bound 2e-14;  force by %.1e N   bound 2e-14\n",
              off, force_off);
  EXPECT_LT(off, 2e-14);
  EXPECT_LT(force_off, 2e-14);
}

/// The largest difference of the rolling disk's place and attitude from the reference up to `end`.
double disk_off(const std::string& method, double h, double end) {
  const auto reference = test::read_json(test::data_file("reference/q_rolling_disk.json"));
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  phs::State s(model.description(), l.start());
  const auto by = make_integrator(method, model, h);
  const auto &turn = l.mechanism->coordinate("disk.attitude"),
             &place = l.mechanism->coordinate("disk.position");
  double off = 0;
  for (const auto& out : reference["outputs"]) {
    const double t = number(out["t"]);
    if (t > end) break;
    while (s.time(h) < t - h / 2) EXPECT_EQ(by->step(s), Outcome::ok);
    const auto& listed = out["group1"];
    for (int k = 0; k < 3; ++k)
      off = std::max(off, std::fabs(s.x[size_t(place.q + k)] - number(listed[size_t(k)])));
    const auto R =
        mechanics::rotation_matrix(mechanics::Quaternion<double>::load(s.x.data() + turn.q));
    const mechanics::Vec3d* columns[] = {&R.x, &R.y, &R.z};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        off = std::max(off, std::fabs((*columns[j])[i] - number(listed[size_t(3 + 3 * i + j)])));
  }
  return off;
}
TEST(Rolling, DiskFollowsTheReference) {
  const double off = disk_off("pgauss16", 1. / 64, 50), coarse = disk_off("pgauss4", 1. / 64, 1);
  std::printf("  off by %.1e in 50 s   bound 1e-12 (condition 327);  pgauss4 by %.1e in 1 s\n", off,
              coarse);
  EXPECT_LT(off, 1e-12);
  EXPECT_GT(coarse, 1e-9);  // control
}

/// A disk that rolls on a circle keeps its tilt, and its centre the closed-form circle.
TEST(Rolling, SteadyCirclesAreKept) {
  const double m = 2, a = 0.5, A = 0.125, C = 0.25, g = 157. / 16;
  double tilt_off = 0, place_off = 0;
  for (const auto& [theta, w2] : {std::pair{1.25, 1.0}, {0.75, -2.5}, {1.0, 3.0}}) {
    const double c = std::cos(theta), sn = std::sin(theta);
    const double W3 = (A * w2 * w2 * c / sn - m * g * a * c) / ((C + m * a * a) * w2);
    auto l = test::rolling_disk(theta, {0, w2, W3});
    const auto model = l.model();
    phs::State s(model.description(), l.start());
    const double h = 1. / 128, turning = w2 / sn, radius = -a * W3 / turning;
    const auto by = make_integrator("pgauss16", model, h);
    const auto &turn = l.mechanism->coordinate("disk.attitude"),
               &place = l.mechanism->coordinate("disk.position");
    for (int i = 1; i <= 1280; ++i) {
      ASSERT_EQ(by->step(s), Outcome::ok);
      const double angle = turning * s.time(h);
      const auto R =
          mechanics::rotation_matrix(mechanics::Quaternion<double>::load(s.x.data() + turn.q));
      tilt_off = std::max(tilt_off, std::fabs(R.z.z - c));
      place_off = std::max({place_off, std::fabs(s.x[size_t(place.q)] - radius * std::sin(angle)),
                            std::fabs(s.x[size_t(place.q) + 1] - radius * (1 - std::cos(angle)))});
    }
  }
  std::printf("  10 s on three circles: tilt off by %.1e, place by %.1e m   bound 1e-12\n",
              tilt_off, place_off);
  EXPECT_LT(tilt_off, 1e-12);
  EXPECT_LT(place_off, 1e-12);
}

/// rms energy error over 2^n steps, relative to the start's 23 J.
double energy_error(const std::string& method, int n, double h, const Options& o = {}) {
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  test::Gauge gauge(model);
  phs::State s(model.description(), l.start());
  const long double first = gauge.energy(s);
  const auto by = make_integrator(method, model, h, o);
  double sum = 0;
  for (int i = 0; i < 1 << n; ++i) {
    EXPECT_EQ(by->step(s), Outcome::ok);
    const double error = double((gauge.energy(s) - first) / first);
    sum += error * error;
  }
  return std::sqrt(sum / (1 << n));
}
TEST(Rolling, DiskKeepsItsEnergyToRounding) {
  const double e = energy_error("pgauss16", 12, 1. / 64),
               loose = energy_error("pgauss16", 12, 1. / 64, {.iteration_tolerance = 1e-10});
  std::printf("  2^12 steps: %.1e = %.1e sqrt(N)   bound 1e-17 sqrt(N);  stopped at 1e-10: %.1e\n",
              e, e / 64, loose);
  EXPECT_LT(e / 64, 1e-17);
  EXPECT_GT(loose, 10 * e);  // control
}
TEST(Rolling, EnergyGrowthLONG) {
  for (const int n : {16, 20}) {
    const double e = energy_error("pgauss16", n, 1. / 64);
    std::printf("  2^%d steps: %.1e = %.1e sqrt(N)\n", n, e, e / std::sqrt(std::pow(2, n)));
    EXPECT_LT(e, 1e-17 * std::sqrt(std::pow(2, n)));
  }
}

TEST(Rolling, EveryStepEndsOnTheManifold) {
  double gap = 0, slip = 0;
  for (auto l : {test::four_bar(), test::bricard(), test::rolling_disk(1.25, {0.5, 1, -6})}) {
    const auto model = l.model();
    const Vec x = l.start();
    const auto system = model.instantiate<double>();
    const auto rows = system->constraints();
    Vec g(size_t(rows->count())), e(x.size());
    for (const char* method :
         {"pgauss2", "pgauss4", "pgauss6", "pgauss8", "pgauss12", "pgauss16"}) {
      phs::State s(model.description(), x);
      const auto by = make_integrator(method, model, 1. / 128);
      for (int i = 0; i < 256; ++i) {
        ASSERT_EQ(by->step(s), Outcome::ok);
        rows->place(s.x, g);
        for (const double r : g) gap = std::max(gap, std::fabs(r));
        system->gradient(s.x, e);
        rows->rates(e, g);
        for (const double r : g) slip = std::max(slip, std::fabs(r));
      }
    }
  }
  std::printf("  gaps %.1e   bound 2e-15;  slips %.1e   bound 2e-14\n", gap, slip);
  EXPECT_LT(gap, 2e-15);
  EXPECT_LT(slip, 2e-14);
}

/// Quaternions stay normed though positions are brought back, at any order. Momenta are kept only
/// to the order of the method, unlike by SPARK.
TEST(Rolling, QuaternionsStayNormed) {
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  Vec values(size_t(model.description().invariant_count()));
  double off = 0;
  for (const char* method : {"pgauss2", "pgauss4", "pgauss16"}) {
    phs::State s(model.description(), l.start());
    const auto by = make_integrator(method, model, 1. / 16);
    for (int i = 0; i < 800; ++i) ASSERT_EQ(by->step(s), Outcome::ok) << method;
    system->invariants(s.x, values);
    off = std::max({off, std::fabs(values[0] - 1), std::fabs(values[1])});
  }
  std::printf("  |xi|^2 - 1 and xi . pi after 50 s with h = 1/16: %.1e   bound 1e-12\n", off);
  EXPECT_LT(off, 1e-12);  // 8.6e-8 if the lift is not kept
}

/// A step that does not come back to the manifold is no step.
TEST(Rolling, AStepThatMissesTheManifoldIsRefused) {
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  Vec g(size_t(rows->count()));
  int ok = 0, refused = 0;
  double gap = 0;
  for (const double h : {2., 1., 0.5, 0.25, 0.125, 0.0625}) {
    phs::State s(model.description(), l.start());
    const phs::State before = s;
    const auto by = make_integrator("pgauss2", model, h);
    if (by->step(s) == Outcome::ok) {
      ++ok;
      rows->place(s.x, g);
      for (const double r : g) gap = std::max(gap, std::fabs(r));
    } else {
      ++refused;
      EXPECT_EQ(s.x, before.x);
      EXPECT_EQ(s.lo, before.lo);
    }
  }
  std::printf("  %d steps kept, gap %.1e   bound 1e-13;  %d refused\n", ok, gap, refused);
  EXPECT_LT(gap, 1e-13);
  EXPECT_GT(ok, 0);
  EXPECT_GT(refused, 0);
}

TEST(Rolling, LanesGiveTheBitsOfSingleStagesAndMemoryResumes) {
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  const Vec x = l.start();
  for (const char* method : {"pgauss6", "pgauss16"}) {
    const auto lanes = make_integrator(method, model, 1. / 64),
               single = make_integrator(method, model, 1. / 64, {.lanes = false});
    phs::State a(model.description(), x), b = a;
    for (int i = 0; i < 40; ++i) {
      ASSERT_EQ(lanes->step(a), Outcome::ok);
      ASSERT_EQ(single->step(b), Outcome::ok);
    }
    EXPECT_EQ(a.x, b.x) << method;
    EXPECT_EQ(a.lo, b.lo) << method;
    const auto resumed = make_integrator(method, model, 1. / 64);
    resumed->restore(lanes->memory());
    ASSERT_EQ(lanes->step(a), Outcome::ok);
    ASSERT_EQ(resumed->step(b), Outcome::ok);
    EXPECT_EQ(a.x, b.x) << method << ", resumed";
  }
}

TEST(Rolling, OtherMethodsAreRefused) {
  auto l = test::rolling_disk(1.25, {0.5, 1, -6});
  const auto model = l.model();
  for (const auto& [method, why] :
       {std::pair{"spark16", "keeps no constraints on rates alone, and 'wheel' rolls"},
        {"gauss16", "keeps no constraints"}})
    try {
      make_integrator(method, model, 0.01);
      ADD_FAILURE() << method;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(why), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace porthos::integrators::projected_gauss_test
