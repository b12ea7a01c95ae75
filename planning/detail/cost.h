#pragma once
#include <Eigen/Core>
#include <cmath>

#include "planning/problem.h"

namespace porthos::planning::detail {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// A running cost at one point, from the field f and its derivative J = [∂f/∂x ∂f/∂u] there.
class CostAtPoint {
 public:
  CostAtPoint(const RunningCost& cost, int nx) : c_(cost), nx_(nx) {}

  /// l at the field f and the inputs u.
  double value(const double* f, const double* u) const {
    double l = 0;
    for (size_t a = 0; a < c_.input.size(); ++a) l += c_.input[a] * u[a] * u[a];
    for (size_t k = 0; k < c_.rate.size(); ++k) l += c_.rate[k] * f[k] * f[k];
    for (const auto& d : c_.drawn) {
      const double P = u[d.input] * f[d.rate];
      l += 0.5 * d.weight * (P + std::sqrt(P * P + d.smoothing * d.smoothing));
    }
    return l;
  }

  /// g = ∇l along (x, u).
  void gradient(const double* f, const Eigen::Ref<const Matrix>& J, const double* u,
                Eigen::Ref<Vector> g) const {
    g.setZero();
    for (size_t a = 0; a < c_.input.size(); ++a) g[nx_ + long(a)] += 2 * c_.input[a] * u[a];
    for (size_t k = 0; k < c_.rate.size(); ++k)
      if (c_.rate[k] != 0) g += 2 * c_.rate[k] * f[k] * J.row(long(k)).transpose();
    for (const auto& d : c_.drawn) {
      const Slopes s(d, u[d.input] * f[d.rate]);
      g += s.first * u[d.input] * J.row(d.rate).transpose();
      g[nx_ + d.input] += s.first * f[d.rate];
    }
  }

  /// ∇²l = H + the part Σ λ_k ∇²f_k, of which λ is added to `lambda`.
  void hessian(const double* f, const Eigen::Ref<const Matrix>& J, const double* u,
               Eigen::Ref<Matrix> H, double* lambda) const {
    H.setZero();
    for (size_t a = 0; a < c_.input.size(); ++a) H(nx_ + long(a), nx_ + long(a)) += 2 * c_.input[a];
    for (size_t k = 0; k < c_.rate.size(); ++k) {
      if (c_.rate[k] == 0) continue;
      H += 2 * c_.rate[k] * J.row(long(k)).transpose() * J.row(long(k));
      lambda[k] += 2 * c_.rate[k] * f[k];
    }
    for (const auto& d : c_.drawn) {
      const Slopes s(d, u[d.input] * f[d.rate]);
      const long at = nx_ + d.input;
      Vector dP = u[d.input] * J.row(d.rate).transpose();
      dP[at] += f[d.rate];
      H += s.second * dP * dP.transpose();
      H.col(at) += s.first * J.row(d.rate).transpose();
      H.row(at) += s.first * J.row(d.rate);
      lambda[d.rate] += s.first * u[d.input];
    }
  }

 private:
  /// Of ½ weight (P + √(P² + ε²)) by P.
  struct Slopes {
    double first, second;
    Slopes(const RunningCost::Drawn& d, double P) {
      const double root = std::sqrt(P * P + d.smoothing * d.smoothing);
      first = 0.5 * d.weight * (1 + P / root);
      second = 0.5 * d.weight * d.smoothing * d.smoothing / (root * root * root);
    }
  };
  const RunningCost& c_;
  long nx_;
};

}  // namespace porthos::planning::detail
