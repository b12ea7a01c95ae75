// Tao's method: symplectic and symmetric in the doubled phase space, and what that leaves of the
// original one.
#include "integrators/methods/tao.h"

#include <gtest/gtest.h>

#include "tests/support/robots.h"

namespace porthos::integrators::tao_test {
namespace {

using phs::Dual;

const mechanics::MechanicalModel& pendulum() {
  static const mechanics::MechanicalModel m(
      test::planar_chain({1, 1}, {1, 1}, {0.5, 0.5}, {1. / 12, 1. / 12}, 9.81));
  return m;
}
const std::vector<double> pendulum_start{0.7, -0.4, 1.1, 0.5};

/// ‖ΨᵀΩΨ - Ω‖∞ of one step on (z, d) with Ω = dq∧dp + dx∧dy = 2 dz_q∧dz_p + ½ dd_q∧dd_p; without_d:
/// of z alone.
double defect_of_doubled_map(const CompositionTable* composition, bool without_d) {
  TaoMap<Dual> map(pendulum(), composition, 20);
  auto system = pendulum().instantiate<Dual>();
  const size_t n = 4;
  std::vector<double> Psi(4 * n * n);
  const auto at = [&](size_t i, size_t j) -> double& { return Psi[i * 2 * n + j]; };
  for (size_t j = 0; j < 2 * n; ++j) {
    std::vector<Dual> z(pendulum_start.begin(), pendulum_start.end()), lo(n, 0.0), d(n, 0.0);
    for (size_t i = 0; i < n; ++i) d[i] = 0.01 * double(i + 1);  // off the diagonal
    (j < n ? z[j] : d[j - n]).d = 1;
    map.advance(*system, 0.0, 0.1, z, lo, d);
    for (size_t i = 0; i < n; ++i) {
      at(i, j) = z[i].d + lo[i].d;
      at(n + i, j) = d[i].d;
    }
  }
  const auto omega = [&](size_t i, size_t j) {
    if (i / n != j / n) return 0.0;
    const double weight = i < n ? 2 : 0.5;
    return i + n / 2 == j && i % n < n / 2 ? weight : j + n / 2 == i && j % n < n / 2 ? -weight : 0;
  };
  double worst = 0;
  const size_t size = without_d ? n : 2 * n;
  for (size_t i = 0; i < size; ++i)
    for (size_t j = 0; j < size; ++j) {
      double sum = -omega(i, j);
      for (size_t k = 0; k < size; ++k)
        for (size_t l = 0; l < size; ++l) sum += at(k, i) * omega(k, l) * at(l, j);
      worst = std::max(worst, std::fabs(sum));
    }
  return worst;
}

TEST(Tao, SymplecticInTheDoubledPhaseSpaceOnly) {
  for (const auto* table :
       {static_cast<const CompositionTable*>(nullptr), &composition_table("yoshida4")}) {
    const double doubled = defect_of_doubled_map(table, false),
                 original = defect_of_doubled_map(table, true);
    std::printf("  order %d: doubled %.1e (1e-13)   original %.1e, must fail\n", table ? 4 : 2,
                doubled, original);
    EXPECT_LE(doubled, 1e-13);
    EXPECT_GT(original, 1e-6);
  }
}

// Back with the copy that came along; Claims.Symmetric turns round without it and must see the
// difference.
TEST(Tao, SymmetricWithItsCopy) {
  const auto robot = test::ets_vii(5);
  for (const char* name : {"tao2", "tao4"}) {
    phs::State s = robot.start;
    const auto there = make_integrator(name, *robot.model, 0.125),
               back = make_integrator(name, *robot.model, -0.125);
    for (int i = 0; i < 40; ++i) ASSERT_EQ(there->step(s), Outcome::ok);
    back->restore(there->memory());
    for (int i = 0; i < 40; ++i) ASSERT_EQ(back->step(s), Outcome::ok);
    double worst = 0;
    for (size_t i = 0; i < s.x.size(); ++i)
      worst =
          std::max(worst, std::fabs(s.x[i] - robot.start.x[i]) / (1 + std::fabs(robot.start.x[i])));
    std::printf("  %s forth and back %.1e   bound 1e-13\n", name, worst);
    EXPECT_LE(worst, 1e-13);
  }
}

/// Largest |copy - original| of the angles over 100 s.
double separation(double binding) {
  Options o;
  o.binding = binding;
  phs::State s(pendulum().description(), pendulum_start);
  const auto method = make_integrator("tao2", pendulum(), 0.005, o);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    if (method->step(s) != Outcome::ok) return INFINITY;
    const auto d = method->memory();
    worst = std::max({worst, std::fabs(d[0]), std::fabs(d[1])});
  }
  return worst;
}

TEST(Tao, TheBindingKeepsTheCopiesTogether) {
  const double bound = separation(20), loose = separation(1e-3);
  std::printf("  copies apart by %.1e at 20/s, by %.1e at 0.001/s\n", bound, loose);
  EXPECT_LE(bound, 1e-2);
  EXPECT_GT(loose, 0.3);
}

// Weights in the units of the system: those of the two angles are inertias, positive and finite.
TEST(Tao, WeightsAreInertias) {
  const auto robot = test::ets_vii();
  const auto m = TaoMap<double>(*robot.model, nullptr, 20).weights();
  for (double w : m) EXPECT_TRUE(w > 0 && std::isfinite(w));
  EXPECT_TRUE(m[0] == m[1] && m[1] == m[2]) << "one weight for the position";
  std::printf("  position %.0f kg (base alone 2552 kg)   attitude %.0f kg m^2\n", m[0], m[3]);
  EXPECT_GT(m[0], 100);
}

}  // namespace
}  // namespace porthos::integrators::tao_test
