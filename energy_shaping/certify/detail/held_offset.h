#pragma once
#include <vector>

#include "energy_shaping/loop/closed_loop.h"

namespace porthos::energy_shaping {

/// What the offset of a state from the rest point costs by H_d's Hessian there, ½ δqᵀ K δq [J]. At
/// another minimum of H_d it is not small, as H_d is. A coordinate without stiffness adds nothing,
/// and neither do full turns of an angle where H_d repeats. 0 too where H_d says no more: of
/// quaternions, and where directions without stiffness are no coordinates, so that they may bend.
class HeldOffset {
 public:
  /// system: evaluates H_d, and must outlive this; K: its Hessian at the rest point
  HeldOffset(const ClosedLoop& loop, phs::System<double>& system, std::vector<double> K);
  double operator()(const std::vector<double>& x);
  /// Whether x, at which H_d has come down, is at another minimum. left, begun: |H_d - H_d(rest)|
  /// there and at the start
  bool elsewhere(const std::vector<double>& x, double left, double begun) {
    // Near the rest point both energies are alike; ten times leaves room for a V_d that is not
    // quadratic, and a part of the start for rounding.
    return operator()(x) > 10 * left + 1e-6 * begun;
  }

 private:
  double K(size_t i, size_t j) const { return K_[i * loop_.rest().size() + j]; }
  double turns(const phs::Block& b, const std::vector<double>& d) const;

  const ClosedLoop& loop_;
  phs::System<double>& system_;
  size_t n_;
  std::vector<double> K_;
  std::vector<size_t> held_ = {};
};

}  // namespace porthos::energy_shaping
