#pragma once
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "energy_shaping/certify/detail/region.h"
#include "energy_shaping/loop/closed_loop.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/scalars/derivative.h"

namespace porthos::energy_shaping {

/// V_d(q) = H_d(q, 0) with derivatives.
class ShapedPotential {
 public:
  explicit ShapedPotential(const ClosedLoop& loop)
      : system_(loop.instantiate<double>()),
        dual_(loop.instantiate<phs::Dual>()),
        n_(loop.rest().size() / 2),
        x_(2 * n_, 0.0),
        e_(2 * n_),
        xd_(2 * n_, phs::Dual(0.0)),
        ed_(2 * n_) {}
  size_t size() const { return n_; }
  double operator()(std::span<const double> q) {
    std::copy(q.begin(), q.end(), x_.begin());
    return system_->hamiltonian(x_);
  }
  void gradient(std::span<const double> q, std::vector<double>& g, std::vector<double>& K) {
    g.resize(n_);
    K.resize(n_ * n_);
    for (size_t i = 0; i < n_; ++i) xd_[i] = q[i];
    auto coordinates = std::span(xd_).first(n_);
    phs::along_each(coordinates, [&](size_t j) {
      dual_->gradient(xd_, ed_);
      for (size_t i = 0; i < n_; ++i) {
        g[i] = ed_[i].v;
        K[i * n_ + j] = ed_[i].d;
      }
    });
  }
  /// Newton's method from q; false if it does not converge or leaves the region by more than the
  /// region's width.
  bool refine(std::vector<double>& q, const Region& r) {
    std::vector<double> g, K;
    for (int i = 0; i < 50; ++i) {
      gradient(q, g, K);
      const std::vector<double> step = phs::linear_solve(n_, K, g);
      double size = 0;
      for (size_t a = 0; a < n_; ++a) {
        const double width = r.upper[a] - r.lower[a];
        if (!(std::fabs(step[a]) < width)) return false;
        q[a] -= step[a];
        size = std::max(size, std::fabs(step[a]) / width);
        if (q[a] < r.lower[a] - width || q[a] > r.upper[a] + width) return false;
      }
      if (size < 1e-12) return true;
    }
    return false;
  }

 private:
  std::unique_ptr<phs::System<double>> system_;
  std::unique_ptr<phs::System<phs::Dual>> dual_;
  size_t n_;
  std::vector<double> x_, e_;
  std::vector<phs::Dual> xd_, ed_;
};

}  // namespace porthos::energy_shaping
