// What set-up and certificates ask of small dense linear algebra.
#include "phs/linear_algebra/linear_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdio>

namespace porthos::phs::linear_algebra_test {
namespace {

/// Eigenvalues: a slow mode, a fast damped oscillation, and zeros of two free directions with their
/// momenta. Seen in turned axes.
std::vector<double> with_slow_mode(double slow) {
  using Eigen::MatrixXd;
  MatrixXd A = MatrixXd::Zero(7, 7);
  A(0, 1) = A(2, 3) = 1;  // q' = p, p' = 0
  A(4, 4) = slow;
  A(5, 6) = 1e3;
  A(6, 5) = -1e3;
  A(6, 6) = -100;
  A(4, 1) = 3;
  A(5, 4) = -2;
  A(3, 0) = 0;
  A(0, 5) = 7;
  std::srand(3);
  const MatrixXd Q = MatrixXd::Random(7, 7).householderQr().householderQ();
  const Eigen::Matrix<double, 7, 7, Eigen::RowMajor> turned = Q * A * Q.transpose();
  return {turned.data(), turned.data() + turned.size()};
}

TEST(Spectrum, TellsASlowUnstableModeFromZeros) {
  for (const double slow : {1e-6, -1e-6, 1e-8}) {
    const Spectrum s = spectrum(7, with_slow_mode(slow));
    ASSERT_EQ(s.zeros, 4);
    ASSERT_EQ(s.rest.size(), 3u);
    double found = HUGE_VAL;
    for (const auto& l : s.rest)
      if (std::abs(l) < 1) found = l.real();
    std::printf("  slow mode %g: found with error %.1e  bound 1e-11 (1e-14 of the fastest)\n", slow,
                std::fabs(found - slow));
    EXPECT_LE(std::fabs(found - slow), 1e-11);
  }
  // Control: without splitting the null spaces off, zeros look like slow modes.
  double smeared = 0;
  for (const auto& l : eigenvalues(7, with_slow_mode(1e-8)))
    if (std::abs(l) < 1) smeared = std::max(smeared, std::abs(l));
  std::printf("  control: eigenvalues() has a zero at %.1e, must exceed 1e-7\n", smeared);
  EXPECT_GT(smeared, 1e-7);
}

/// Feedback matrices with two Jordan blocks, on which Eigen's iteration gives up now and then: its
/// numbers are then anything.
TEST(Eigenvalues, OfDoubleRootsComeFromTheTransposeWhereTheSweepsStagnate) {
  const double a = 16.0696, b = 47.1878;
  const std::complex<double> s(0.3, 0.8);
  int given_up = 0;
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double w = 1.41485 + 1e-10 * i, zeta = 1.04797, m = 0.832358;
    const double c3 = 4 * zeta * w, c2 = (2 + 4 * zeta * zeta) * w * w, c1 = c3 * w * w,
                 c0 = w * w * w * w;
    // x'' = a (m x - u), y'' = b u, u = K1 x + K2 y + (D1 x' + D2 y')
    const double K2 = c0 / (a * b * m), D2 = c1 / (a * b * m), D1 = c3 / a + D2 * b / a,
                 K1 = c2 / a + m + K2 * b / a;
    const std::vector<double> A{0,      0,   a,       0,       0,  0,  0,      b,
                                m - K1, -K2, -D1 * a, -D2 * b, K1, K2, D1 * a, D2 * b};
    const Eigen::EigenSolver<Eigen::MatrixXd> once(
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(A.data()), false);
    given_up += once.info() != Eigen::Success;
    std::complex<double> p = 1;
    for (const auto& l : eigenvalues(4, A)) p *= s - l / w;
    const auto wanted = std::pow(s * s + 2 * zeta * s + 1.0, 2);
    worst = std::max(worst, std::abs(p - wanted) / std::abs(wanted));
    if (std::isnan(p.real())) worst = HUGE_VAL;
  }
  std::printf(
      "  given up by one attempt: %d of 20000, must exceed 0; characteristic polynomial off "
      "by %.1e   bound 1e-11\n",
      given_up, worst);
  EXPECT_GT(given_up, 0) << "control";
  EXPECT_LT(worst, 1e-11);  // 4 rounding errors of entries 50 times the roots
}

/// Metres and millimetres, or a heavy and a light coordinate, do not decide what is definite.
/// Control: the ratio of the eigenvalues changes by the square of the units.
TEST(Definiteness, IsTheSameInAllUnits) {
  const std::vector<double> A{2, -1.2, 0, -1.2, 1, 0.3, 0, 0.3, 0.5};
  const double unit[] = {1e3, 1e-4, 1};
  auto other = A;
  for (size_t i = 0; i < 9; ++i) other[i] *= unit[i / 3] * unit[i % 3];
  const auto a = definiteness(3, A), b = definiteness(3, other);
  const auto values = symmetric_eigenvalues(3, other);
  std::printf("  least %.6f and %.6f at %zu; ratio of eigenvalues %.1e\n", a.least, b.least,
              a.where, values.front() / values.back());
  EXPECT_NEAR(a.least, b.least, 4e-15);  // 16 roundings
  EXPECT_EQ(a.where, 1u);
  EXPECT_EQ(b.where, 1u);
  EXPECT_LT(values.front() / values.back(), 1e-12);
  // λ of the unit matrix with ρ₁ = -1.2 / √2 and ρ₂ = 0.3 / √0.5 beside it: 1 - √(ρ₁² + ρ₂²).
  EXPECT_NEAR(a.least, 1 - std::sqrt(0.72 + 0.18), 4e-15);
  EXPECT_NEAR(definiteness(2, std::vector<double>{1, 3, 3, 4}).least, 1 - 1.5, 4e-15);
  EXPECT_EQ(definiteness(2, std::vector<double>{1, 0, 0, 0}).least, 0) << "a row of zeros";
  EXPECT_NEAR(definiteness(2, std::vector<double>{1, 0, 0, -7}).least, -1, 4e-15);
  EXPECT_TRUE(std::isnan(definiteness(1, std::vector<double>{NAN}).least));
}

TEST(Spectrum, OfNothingAndOfNoNumber) {
  EXPECT_EQ(spectrum(2, std::vector<double>(4, 0.0)).zeros, 2);
  EXPECT_TRUE(std::isnan(spectrum(1, std::vector<double>{NAN}).rest[0].real()));
}

}  // namespace
}  // namespace porthos::phs::linear_algebra_test
