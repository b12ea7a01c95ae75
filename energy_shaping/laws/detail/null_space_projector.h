#pragma once
#include <span>
#include <vector>

#include "energy_shaping/laws/null_space.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::energy_shaping {

/// J, M and what projects, at one q.
template <class T>
class NullSpaceProjector {
 public:
  explicit NullSpaceProjector(const NullSpaceLoop& loop)
      : loop_(loop),
        m_(loop.task().mechanical().mechanism()),
        w_(m_),
        n_(size_t(m_.nv())),
        r_(loop.rows().size()),
        all_(6 * n_),
        J_(r_ * n_),
        M_(n_ * n_),
        L_(n_ * n_),
        S_(r_ * r_),
        LS_(r_ * r_),
        column_(n_),
        a_(r_) {}

  void place(std::span<const T> q) {
    const auto& frame = loop_.task().parts().poses[0].frame;
    mechanics::jacobian<T>(m_, w_, q, frame, mechanics::JacobianAxes::body, std::span<T>(all_));
    for (size_t i = 0; i < r_; ++i)
      for (size_t j = 0; j < n_; ++j) J_[i * n_ + j] = all_[6 * j + size_t(loop_.rows()[i])];
    mechanics::crba<T>(m_, w_, q, std::span<T>(M_));
    phs::dense::cholesky(n_, M_.data(), L_.data());
    for (size_t i = 0; i < r_; ++i) {  // J M⁻¹Jᵀ, column by column
      phs::dense::solve(n_, L_.data(), J_.data() + i * n_, column_.data());
      for (size_t k = 0; k < r_; ++k)
        S_[k * r_ + i] = phs::dense::dot(n_, J_.data() + k * n_, column_.data());
    }
    phs::dense::cholesky(r_, S_.data(), LS_.data());
  }
  /// a = J M⁻¹τ
  const std::vector<T>& acceleration(const T* tau) {
    phs::dense::solve(n_, L_.data(), tau, column_.data());
    phs::dense::multiply(r_, n_, J_.data(), column_.data(), a_.data());
    return a_;
  }
  /// w = Jᵀ J̄ᵀ τ, the part of τ that the task feels.
  void felt(const T* tau, T* w) {
    (void)acceleration(tau);
    phs::dense::solve(r_, LS_.data(), a_.data(), a_.data());
    phs::dense::multiply_transposed(r_, n_, J_.data(), a_.data(), w);
  }
  const std::vector<T>& jacobian() const { return J_; }

 private:
  const NullSpaceLoop& loop_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  size_t n_, r_;
  std::vector<T> all_, J_, M_, L_, S_, LS_, column_, a_;
};

}  // namespace porthos::energy_shaping
