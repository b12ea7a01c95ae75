// Tangents along a run: monodromy matrices and Lyapunov spectra.
#include "integrators/derivatives/tangent_run.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "integrators/derivatives/run_gradient.h"
#include "tests/integrators/problems.h"
#include "tests/support/pendulum.h"

namespace porthos::integrators::tangent_run_test {
namespace {

using test::Problem;
using Matrix = Eigen::MatrixXd;
using Vec = std::vector<double>;

Matrix matrix_of(const Monodromy& m) {
  const auto n = Eigen::Index(std::lround(std::sqrt(double(m.matrix.size()))));
  return Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(m.matrix.data(), n, n);
}

/// |MᵀJM - J| against |M|², which it is a difference of.
double off_symplectic(const Matrix& M) {
  const Eigen::Index n = M.rows() / 2;
  Matrix J = Matrix::Zero(2 * n, 2 * n);
  J.topRightCorner(n, n) = Matrix::Identity(n, n);
  J.bottomLeftCorner(n, n) = -Matrix::Identity(n, n);
  return (M.transpose() * J * M - J).norm() / M.squaredNorm();
}

/// I = 0.8 kg m² about its hinge.
mechanics::MechanicalModel damped_pendulum() {
  mechanics::MechanismBuilder b("pendulum");
  b.gravity({0, 0, -9.81});
  mechanics::BodySpec rod;
  rod.name = "rod";
  rod.parent = "world";
  rod.joint.name = "hinge";
  rod.joint.type = "revolute";
  rod.joint.axis = {0, 1, 0};
  rod.joint.damping = 0.3;
  rod.mass.mass = 2;
  rod.mass.com = {0, 0, -0.5};
  rod.mass.inertia = {0.4, 0, 0, 0.3, 0, 0.2};
  b.add(rod);
  return mechanics::MechanicalModel(std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// Its rows are the gradients of the end's numbers, which come by the adjoint.
TEST(Monodromy, IsSymplecticAndTheTransposeOfTheAdjoint) {
  for (const Problem& p : {test::double_pendulum(), test::floating_arm()}) {
    const int steps = 60;
    const auto m = monodromy("gauss12", *p.model, p.start, p.h, steps);
    ASSERT_EQ(m.outcome, Outcome::ok) << m.remark;
    const Matrix M = matrix_of(m);
    const size_t n = p.start.x.size();
    double worst = 0;
    for (size_t i = 0; i < n; ++i) {
      Objective o;
      o.end = [i](double, std::span<const double> x, std::span<double> g) {
        g[i] = 1;
        return x[i];
      };
      const auto g = gradient_of_run("gauss12", *p.model, p.start, p.h, steps, o);
      for (size_t k = 0; k < n; ++k)
        worst = std::max(worst, std::fabs(M(Eigen::Index(i), Eigen::Index(k)) - g.start[k]));
    }
    worst /= M.norm();
    std::printf(
        "  %-15s |M| %.0f, off symplectic by %.1e of |M|^2 (bound 1e-15), off the adjoint by %.1e "
        "of |M| (bound 1e-14)\n",
        p.name.c_str(), M.norm(), off_symplectic(M), worst);
    EXPECT_LT(off_symplectic(M), 1e-15);
    EXPECT_LT(worst, 1e-14);
  }
  const auto damped = damped_pendulum();  // control
  const auto m =
      monodromy("gauss12", damped, {damped.description(), damped.state(Vec{1}, Vec{0})}, 0.1, 60);
  EXPECT_GT(off_symplectic(matrix_of(m)), 1e-3);
}

/// 2π/agm(1, cos(θ/2)), of the pendulum at unit frequency (Gauss).
double period_of_swing(double amplitude) {
  double a = 1, b = std::cos(amplitude / 2);
  for (int i = 0; i < 8; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return 2 * M_PI / a;
}

/// Over one period the direction of motion and the energy return: 1 is a multiplier twice, with a
/// Jordan block, so that a rounding ε moves it by √ε.
TEST(Monodromy, OfAPeriodicOrbitHasTheMultiplierOneTwice) {
  const double amplitude = 2.5, period = period_of_swing(amplitude);
  const int steps = 64;
  const phs::UserModel<test::Pendulum> model{test::Pendulum{}};
  const phs::State start(model.description(), {amplitude, 0.0});
  const auto m = monodromy("gauss16", model, start, period / steps, steps);
  ASSERT_EQ(m.outcome, Outcome::ok) << m.remark;
  const Matrix M = matrix_of(m);
  const Eigen::Vector2d f(0, -std::sin(amplitude));  // the field at the start
  const double closes = std::hypot(m.end.x[0] - amplitude, m.end.x[1]);
  const double along = (M * f - f).norm(), trace = std::fabs(M.trace() - 2);
  const Eigen::VectorXcd multipliers = M.eigenvalues();
  const double one = std::max(std::abs(multipliers[0] - 1.0), std::abs(multipliers[1] - 1.0));
  // Control: over half a period it is another matrix.
  const Matrix half = matrix_of(monodromy("gauss16", model, start, period / steps, steps / 3));
  std::printf(
      "  closes to %.1e, M f - f %.1e, trace - 2 %.1e (bounds 1e-12), multipliers off 1 by %.1e "
      "(bound 1e-5), shear %.1f;  a third of a period: trace %.2f\n",
      closes, along, trace, one, std::fabs(M(1, 0)), half.trace());
  EXPECT_LT(closes, 1e-12);
  EXPECT_LT(along, 1e-12);
  EXPECT_LT(trace, 1e-12);
  EXPECT_LT(one, 1e-5);
  EXPECT_GT(std::fabs(half.trace() - 2), 0.1);
}

double sum_of(const Vec& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum;
}

/// Energy 1/8 and a start in the chaotic sea, against a regular one.
TEST(LyapunovSpectrum, OfHenonAndHeilesAddsUpToZeroInPairs) {
  const auto at = [](double y, double py, double energy) {
    const double px = std::sqrt(2 * (energy - y * y / 2 + y * y * y / 3) - py * py);
    return test::user_problem(test::HenonHeiles{}, {0, y, px, py}, 0.25);
  };
  const Problem chaotic = at(-0.15, 0.1, 1.0 / 6 - 1e-3), regular = at(0.1, 0.0, 1.0 / 24);
  const int steps = 8000;
  const auto r = lyapunov_spectrum("gauss8", *chaotic.model, chaotic.start, chaotic.h, steps,
                                   {.settle = 200, .every = 4});
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  const auto& e = r.exponents;
  const auto calm = lyapunov_spectrum("gauss8", *regular.model, regular.start, regular.h, steps);
  std::printf("  %.4f %.4f %.4f %.4f, sum %.1e (bound 1e-13);  second half %.4f;  regular %.4f\n",
              e[0], e[1], e[2], e[3], sum_of(e), r.of_second_half[0], calm.exponents[0]);
  EXPECT_LT(std::fabs(sum_of(e)), 1e-13);
  EXPECT_GT(e[0], 0.05);
  EXPECT_LT(std::fabs(e[0] + e[3]), 0.005) << "like 1/t, here 1/2000 and a logarithm";
  EXPECT_LT(std::fabs(e[1]) + std::fabs(e[2]), 0.01);
  EXPECT_LT(calm.exponents[0], 0.006) << "ln t / t is 0.004";
  EXPECT_NEAR(r.time, 2000, 1e-9);

  const auto largest = lyapunov_spectrum("gauss8", *chaotic.model, chaotic.start, chaotic.h, steps,
                                         {.count = 1, .settle = 200, .every = 4});
  ASSERT_EQ(largest.exponents.size(), 1U);
  EXPECT_NEAR(largest.exponents[0], e[0], 0.005) << "another first direction";
}

/// tr Df = -d/I of a damped joint of one body.
TEST(LyapunovSpectrum, OfDampingAddsUpToItsRate) {
  const auto model = damped_pendulum();
  const phs::State start(model.description(), model.state(Vec{1.0}, Vec{0.5}));
  const auto r = lyapunov_spectrum("gauss16", model, start, 0.1, 1000);
  ASSERT_EQ(r.outcome, Outcome::ok) << r.remark;
  const double expected = -0.3 / 0.8;
  std::printf("  %.15f, %.15f expected: off by %.1e (bound 1e-12)\n", sum_of(r.exponents), expected,
              std::fabs(sum_of(r.exponents) - expected));
  EXPECT_NEAR(sum_of(r.exponents), expected, 1e-12);
  EXPECT_NEAR(r.exponents[0], expected / 2, 0.02) << "a focus: both have half of it";
}

TEST(LyapunovSpectrum, RefusesWhatItCannotDo) {
  const Problem p = test::double_pendulum();
  const auto refused = [&](const std::string& method, std::int64_t steps,
                           const LyapunovOptions& options, const std::string& words) {
    try {
      (void)lyapunov_spectrum(method, *p.model, p.start, p.h, steps, options);
      ADD_FAILURE() << "expected: " << words;
    } catch (const InvalidArgument& e) {
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
  };
  refused("spark8", 10, {}, "not for 'spark8'");
  refused("gauss8", 1, {}, "steps is 1, expected steps >= 2");
  refused("gauss8", 10, {.count = 5}, "count is 5, expected 1 to 4");
  refused("gauss8", 10, {.settle = -1}, "settle is -1, expected settle >= 0");
  refused("gauss8", 10, {.every = 0}, "every is 0, expected every >= 1");
  const std::atomic<bool> stop{true};
  const auto r = lyapunov_spectrum("gauss8", *p.model, p.start, p.h, 10, {.stop = &stop});
  EXPECT_EQ(r.outcome, Outcome::failed);
  EXPECT_EQ(r.remark, "the run was stopped");
}

}  // namespace
}  // namespace porthos::integrators::tangent_run_test
