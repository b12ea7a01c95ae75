// The inertia of a body as ten free numbers: there and back, and always physical.
#include "mechanics/log_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "mechanics/rotation.h"

namespace porthos::mechanics {
namespace {

/// The pseudo-inertia [Σ h; hᵀ m] about the body's origin (Wensing, Kim, Slotine 2017).
Eigen::Matrix4d pseudo_inertia(const MassProperties& b) {
  const auto I = rotated(b.axes, b.inertia);
  const double half = (I.xx + I.yy + I.zz) / 2;
  Eigen::Matrix3d S;
  S << half - I.xx, -I.xy, -I.xz, -I.xy, half - I.yy, -I.yz, -I.xz, -I.yz, half - I.zz;
  const Eigen::Vector3d c(b.com.x, b.com.y, b.com.z);
  Eigen::Matrix4d P;
  P.topLeftCorner<3, 3>() = S + b.mass * c * c.transpose();
  P.topRightCorner<3, 1>() = P.bottomLeftCorner<1, 3>().transpose() = b.mass * c;
  P(3, 3) = b.mass;
  return P;
}

/// That it is the factor of Rucker and Wensing's eq. 17: P = U Uᵀ, U = e^α [… 1].
TEST(LogCholesky, IsTheFactorOfThePseudoInertia) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal;
  double worst = 0, back = 0, control = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    LogCholesky n;
    for (double& x : n) x = normal(rng);
    const MassProperties b = from_log_cholesky(n);
    Eigen::Matrix4d U;
    U << std::exp(n[1]), n[4], n[6], n[7], 0, std::exp(n[2]), n[5], n[8], 0, 0, std::exp(n[3]),
        n[9], 0, 0, 0, 1;
    U *= std::exp(n[0]);
    const Eigen::Matrix4d P = pseudo_inertia(b);
    worst = std::max(worst, (P - U * U.transpose()).norm() / P.norm());
    control = std::max(control, (P - U.transpose() * U).norm() / P.norm());
    const LogCholesky again = log_cholesky(b);
    // Small axes are differences of numbers of the size of the large ones, twice over.
    const Eigen::Matrix3d L = U.topLeftCorner<3, 3>() / std::exp(n[0]);
    const double least = std::exp(2 * std::min({n[1], n[2], n[3]}));
    const double amplified = 0x1p-52 * std::pow(L.squaredNorm() / least, 2);
    for (size_t i = 0; i < n.size(); ++i)
      back = std::max(back, std::fabs(again[i] - n[i]) / amplified);
    const double smallest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(P).eigenvalues()[0];
    EXPECT_GT(smallest, -1e-13 * P.norm());
  }
  // Rounding of sums of four products; the way back amplifies it as above.
  std::printf("  P - UU^T %.1e of P   bound 1e-14; there and back %.1f of rounding   bound 10\n",
              worst, back);
  EXPECT_LT(worst, 1e-14);
  EXPECT_LT(back, 10);
  EXPECT_GT(control, 0.1);
}

TEST(LogCholesky, OfTurnedAxes) {
  MassProperties b{3, {0.1, -0.2, 0.3}, {2, 0.1, -0.2, 1.8, 0.05, 1.5}, Mat3<double>::identity()};
  b.axes = rotation_matrix(Quaternion<double>{0.5, {0.5, -0.5, 0.5}});
  const auto same = from_log_cholesky(log_cholesky(b));
  EXPECT_LT((pseudo_inertia(same) - pseudo_inertia(b)).norm(),
            1e-15 * pseudo_inertia(b).norm() * 4);
}

TEST(LogCholesky, RefusesABodyThatIsNone) {
  const auto refused = [](double mass, double zz) {
    EXPECT_THROW(
        (void)log_cholesky({mass, {0, 0, 0}, {1, 0, 0, 1, 0, zz}, Mat3<double>::identity()}),
        InvalidArgument);
  };
  refused(1, 2.1);  // the triangle inequality
  refused(1, 2);    // a flat body is its limit
  refused(0, 1);
  refused(-1, 1);
  EXPECT_NO_THROW(
      (void)log_cholesky({1, {0, 0, 0}, {1, 0, 0, 1, 0, 1.9}, Mat3<double>::identity()}));
}

}  // namespace
}  // namespace porthos::mechanics
