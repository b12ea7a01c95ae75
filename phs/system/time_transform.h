#pragma once
#include <memory>

#include "phs/system/time_scale.h"

namespace porthos::phs {

/// A system in fictitious time tau, dt = sigma(x) dtau (Poincare's transformation; Hairer, Lubich,
/// Wanner 2006, VIII.2.1). With physical time t and its conjugate p_t as coordinates,
///
///   K(x, t, p_t) = sigma(x) (H(x) + p_t),    x' = sigma J ∂H + (H + p_t) J ∂sigma,
///     t' = sigma,    p_t' = 0,
///
/// so constant steps in tau are variable steps in t, and a structure-preserving method preserves
/// the structure of K. With p_t = -H(x) at the start, K stays 0 and x follows the solution of the
/// original system.
///
/// What the original system gains or loses, g = x' - J ∂H (damping, a time-dependent drive), is
/// balanced by p_t: x' += sigma g, p_t' = -g·∂K/∂x. This structure matrix is skew too, so K is
/// conserved and K = 0 stays true.
///
/// Constraints stay those of x: Gᵀλ enters p', and K is 0 on their manifold too. Rows that move
/// would push p_t, and rows that roll have no Hamiltonian; both are refused.
///
/// State, of n + 2 numbers: for a canonical system, x with t inserted after its first half and p_t
/// at the end. That system is canonical again if the original is lossless and autonomous. For
/// others: (x, t, p_t). It has no ports and no declared invariants besides K. The ledger is that of
/// the original system, with powers per tau.
class TimeTransformedModel : public ModelFor<TimeTransformedModel> {
 public:
  /// Model and scale must outlive this object. @throws InvalidArgument for constraints that roll or
  /// move
  TimeTransformedModel(const Model& model, const TimeScaleModel& scale);

  const Description& description() const override { return description_; }
  const Model& model() const { return model_; }
  const TimeScaleModel& scale() const { return scale_; }

  size_t time_at() const { return half_; }
  size_t energy_at() const { return n_ + 1; }  ///< of p_t
  /// The offset of number i of x.
  size_t position(size_t i) const { return i < half_ ? i : i + 1; }

  template <class T>
  std::unique_ptr<System<T>> make_system() const;

 private:
  const Model& model_;
  const TimeScaleModel& scale_;
  size_t n_, half_;
  Description description_;
};

}  // namespace porthos::phs
