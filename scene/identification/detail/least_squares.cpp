#include "scene/identification/detail/least_squares.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace porthos::scene {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

std::vector<double> moved(const std::vector<double>& z, const VectorXd& by) {
  std::vector<double> to = z;
  for (size_t i = 0; i < z.size(); ++i) to[i] += by[Index(i)];
  return to;
}

/// Σ v_i² over the components that the data tell, of v = Uᵀr with J = U S Vᵀ.
double told_part(const Fit& fit, const VectorXd& r) {
  double sum = 0;
  for (Index i = 0; i < fit.singular.size(); ++i)
    if (fit.tells(i)) sum += std::pow(fit.noise * fit.shift(r, i), 2);
  return sum;
}

class LevenbergMarquardt {
 public:
  LevenbergMarquardt(const Residuals& residuals, std::vector<double> z, const FitOptions& options)
      : residuals_(residuals), o_(options) {
    fit_.z = std::move(z);
  }

  Fit run() {
    constexpr double enough = 1e-6;  // of the noise's variance
    if (!residuals_(fit_.z, fit_.r, &fit_.slopes)) return fit_;
    fit_.iterates.push_back(fit_.z);
    for (double before = HUGE_VAL;;) {
      decompose();
      const double square = fit_.r.squaredNorm(), n = double(fit_.r.size());
      if (!o_.noise_known)
        fit_.noise = std::sqrt(square / std::max(1.0, n - double(fit_.z.size())));
      fit_.converged = told_part(fit_, fit_.r) <= enough * fit_.noise * fit_.noise ||
                       before - square < o_.share * before;
      if (!o_.go_on(fit_) || fit_.converged || fit_.iterations == o_.most) return fit_;
      before = square;
      ++fit_.iterations;
      if (!improve(square)) return fit_;
    }
  }

 private:
  void decompose() {
    const Index k = fit_.slopes.cols();
    const Eigen::HouseholderQR<MatrixXd> qr(fit_.slopes);
    const MatrixXd R = qr.matrixQR().topRows(k).triangularView<Eigen::Upper>();
    const Eigen::JacobiSVD<MatrixXd> svd(R, Eigen::ComputeFullV);
    fit_.singular = svd.singularValues();
    fit_.directions = svd.matrixV();
  }
  /// -(JᵀJ + λ)⁻¹ Jᵀx
  VectorXd solved(const VectorXd& x) const {
    const VectorXd g = fit_.directions.transpose() * (fit_.slopes.transpose() * x);
    return -(fit_.directions * (g.array() / (fit_.singular.array().square() + lambda_)).matrix());
  }
  static double length(const VectorXd& dz) { return dz.lpNorm<Eigen::Infinity>(); }

  /// The step and half of its acceleration: along a curved valley it follows the floor. Source:
  /// Transtrum, Sethna 2012, arXiv:1201.5885, eq. 13 and 15.
  VectorXd bent(const VectorXd& dz) {
    constexpr double part = 0.1, most = 0.75;
    if (!residuals_(moved(fit_.z, part * dz), r_, nullptr)) return dz;
    const VectorXd bend = solved(2 / part * ((r_ - fit_.r) / part - fit_.slopes * dz));
    return 2 * length(bend) < most * length(dz) ? VectorXd(dz + bend / 2) : dz;
  }

  /// Steps with growing λ until one lessens |r|². @return false: there is none
  bool improve(double square) {
    constexpr double weight = 0.1, rounding = 1e-12;  // weight: of keeping a z where it is
    lambda_ = std::max(lambda_, std::pow(weight * fit_.noise, 2));
    for (double growth = 2;; lambda_ *= growth, growth *= 2) {
      const VectorXd dz = solved(fit_.r);
      if (length(dz) < rounding) {  // or the edge
        fit_.converged = !fit_.at_edge;
        return false;
      }
      if (length(dz) > longest_) continue;
      const VectorXd step = bent(dz);
      bool there = residuals_(moved(fit_.z, step), r_, nullptr);
      const double gain =
          there ? (square - r_.squaredNorm()) / (square - (fit_.r + fit_.slopes * dz).squaredNorm())
                : 0;
      if (gain > 1e-4) {
        there = residuals_(moved(fit_.z, step), r_, &slopes_);
        if (there) return accept(step, gain, length(dz));
      }
      if (there) continue;
      fit_.at_edge = true;
      ++fit_.refused;
      if (!o_.go_on(fit_)) return false;
    }
  }
  bool accept(const VectorXd& step, double gain, double length) {
    fit_.z = moved(fit_.z, step);
    fit_.r = r_;
    fit_.slopes = slopes_;
    fit_.iterates.push_back(fit_.z);
    fit_.at_edge = false;
    if (gain > 0.75 && length > longest_ / 2) longest_ *= 2;
    if (gain < 0.25) longest_ = std::max(shortest, longest_ / 2);
    lambda_ *= gain > 0.75 ? 0.1 : std::max(1.0 / 3, 1 - std::pow(2 * gain - 1, 3));
    return true;
  }

  const Residuals& residuals_;
  const FitOptions& o_;
  Fit fit_;
  VectorXd r_;
  MatrixXd slopes_;
  static constexpr double shortest = 0.5;
  double lambda_ = 0, longest_ = shortest;  ///< longest: step of a z, a trust region
};

}  // namespace

double Fit::deviation(Index i) const {
  constexpr double rounding = 1e-9;  // of the Jacobian, by differences
  return singular[i] > rounding * singular[0] ? noise / singular[i] : HUGE_VAL;
}

double Fit::shift(const VectorXd& change, Index i) const {
  return directions.col(i).dot(slopes.transpose() * change) / singular[i] / noise;
}

Fit least_squares(const Residuals& residuals, std::vector<double> z, const FitOptions& options) {
  return LevenbergMarquardt(residuals, std::move(z), options).run();
}

}  // namespace porthos::scene
