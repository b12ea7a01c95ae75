#pragma once
#include <span>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/scalars/dual.h"

namespace porthos::energy_shaping {

/// The links of an arm with springs of the constants K between motors and joints, and their motion
/// up to the jerk, from the model:
///   M a + b(q, v) + ∂V + D0 v = K (θ - q) = τ,   M j + d/dt [M a + b + ∂V] + D0 a = τ'
/// where the bracket is differentiated at constant a, along (v, a), by dual numbers; D0 is the
/// damping of the model's joints. Of the load g = ∂V/∂q, springs of the model's joints included,
/// two derivatives in time. Cost: three RNEA, two of them in duals of duals, and a mass matrix.
template <class T>
class LinkMotion {
  using In = std::span<const T>;

 public:
  /// m must outlive this object; K: of each joint.
  LinkMotion(const mechanics::Mechanism& m, std::vector<double> K);
  /// Moves to coordinates q, momenta p, motor positions θ and their rates.
  void at(In q, In p, In theta, In theta_rate);

  std::vector<T> v, a, jerk;                    ///< q', q'', q'''
  std::vector<T> load, load_rate, load_second;  ///< g, g', g''

 private:
  using D = phs::BasicDual<T>;
  using DD = phs::BasicDual<D>;
  void solve_mass(std::vector<T>& force) const;

  const mechanics::Mechanism& m_;
  std::vector<double> K_;
  mechanics::Workspace<T> w_;
  mechanics::Workspace<DD> wd_;
  size_t n_;
  std::vector<T> M_, L_, tau_;
  std::vector<DD> q_, v_, a_, out_;
};

}  // namespace porthos::energy_shaping
