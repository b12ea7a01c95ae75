#pragma once
#include <cstdint>
#include <memory>

#include "integrators/core/turns.h"

/// Resolvents for systems without their own. J comes from dual numbers.
namespace porthos::integrators {

/// A map f of nx numbers whose Jacobian is needed, evaluated in duals: a field, or a method's
/// replacement for it.
class DualField {
 public:
  virtual ~DualField() = default;
  virtual void tell_turns(const std::vector<std::int64_t>& turns) = 0;
  /// f at (t, x), size nx. Returns the number of evaluations of the system's field, or the
  /// equivalent.
  virtual int operator()(double t, std::span<const phs::Dual> x, std::span<phs::Dual> f) = 0;
};
/// The field of the model, which must outlive it.
std::unique_ptr<DualField> field_in_duals(const phs::Model& model);

/// A resolvent that counts its field evaluations.
class DualResolvent : public phs::Resolvent {
 public:
  virtual std::int64_t evaluations() const = 0;
};

/// LU of I - z J, for four z at once with common pivots. A factorisation costs nx dual evaluations
/// and O(nx³), a solve O(nx²). The field must outlive it.
std::unique_ptr<DualResolvent> make_dense_resolvent(DualField& field, size_t nx);

/// GMRES (Saad, Schultz 1986) to a relative residual of 1e-3: two dual evaluations per iteration
/// and lane, without forming J. If `about`, a resolvent of nearly the same J, is given, it is the
/// right preconditioner. Both must outlive it.
std::unique_ptr<DualResolvent> make_krylov_resolvent(DualField& field, size_t nx,
                                                     phs::Resolvent* about);

}  // namespace porthos::integrators
