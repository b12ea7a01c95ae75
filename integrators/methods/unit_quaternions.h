#pragma once
#include <span>
#include <vector>

#include "phs/system/system.h"

namespace porthos::integrators {

/// The quaternion blocks ξ of a canonical state, for methods of the Störmer-Verlet kind: these do
/// not conserve |ξ| = 1 by themselves. Their kicks have a multiplier along ξ, for the Hamiltonian
/// H + (κ/2)(ξ·π)². It equals H on ξ·π = 0 and makes the multiplier well defined. κ is a quarter of
/// the mean inverse inertia at the zero configuration.
template <class T>
struct UnitQuaternions {
  struct Rotation {
    size_t q;  ///< offset of ξ in q; π has the same offset in p
    T kappa = T(0.0);
    T lambda = T(0.0);  ///< multiplier of the first kick; the next start value
    T lambda_before = T(0.0);
  };

  explicit UnitQuaternions(phs::System<T>& system) : n_(size_t(system.description().nx) / 2) {
    for (const auto& b : system.description().blocks)
      if (b.kind == phs::BlockKind::rotation) all.push_back({size_t(b.at)});
    scale(system);
  }

  /// f += (∂p, -∂q) of Σ (κ/2)(ξ·π)² at x.
  void add_to_field(const std::vector<T>& x, std::vector<T>& f) const {
    for (const auto& r : all) {
      const T along = dot(r, x, x);
      for (size_t k = 0; k < 4; ++k) {
        f[r.q + k] += r.kappa * along * x[r.q + k];
        f[n_ + r.q + k] = f[n_ + r.q + k] - r.kappa * along * x[n_ + r.q + k];
      }
    }
  }
  /// |ξ|² - 1
  static T excess(const Rotation& r, const std::vector<T>& x) {
    T sum(-1.0);
    for (size_t k = 0; k < 4; ++k) sum += x[r.q + k] * x[r.q + k];
    return sum;
  }
  /// ξ·π, ξ of one state and π of another.
  T dot(const Rotation& r, const std::vector<T>& q, const std::vector<T>& p) const {
    T sum(0.0);
    for (size_t k = 0; k < 4; ++k) sum += q[r.q + k] * p[n_ + r.q + k];
    return sum;
  }

  std::vector<Rotation> all;

 private:
  /// κ from the field at the zero configuration, so that it depends on the system and not on a
  /// state. ξ' = ½ ξ∘ω with ω = I⁻¹m, so at ξ = 1 the mean of π·ξ'/|π|² over π = i, j, k is a
  /// quarter of the mean inverse inertia.
  void scale(phs::System<T>& system) {
    if (all.empty()) return;
    std::vector<T> x(2 * n_, T(0.0)), f(x);
    for (const auto& r : all) x[r.q] = T(1.0);
    for (auto& r : all) {
      for (size_t k = 1; k < 4; ++k) {
        x[n_ + r.q + k] = T(1.0);
        system.field(T(0.0), x, {}, f);
        x[n_ + r.q + k] = T(0.0);
        r.kappa += f[r.q + k] / T(3.0);
      }
    }
  }

  size_t n_;
};

}  // namespace porthos::integrators
