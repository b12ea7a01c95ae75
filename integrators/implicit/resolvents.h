#pragma once
#include <cstdint>
#include <memory>

#include "integrators/core/turns.h"

/// Resolvents for systems that offer none of their own. J comes from dual numbers.
namespace porthos::integrators {

/// A map f of nx numbers whose Jacobian is wanted, evaluated in duals: a field, or what stands in
/// its place in a method.
class DualField {
 public:
  virtual ~DualField() = default;
  virtual void tell_turns(const std::vector<std::int64_t>& turns) = 0;
  /// f at (t, x), size nx. Returns the evaluations of the system's field it takes, or their like.
  virtual int operator()(double t, std::span<const phs::Dual> x, std::span<phs::Dual> f) = 0;
};
/// The field of the model, which must outlive it.
std::unique_ptr<DualField> field_in_duals(const phs::Model& model);

/// A resolvent that counts the field evaluations it makes.
class DualResolvent : public phs::Resolvent {
 public:
  virtual std::int64_t evaluations() const = 0;
};

/// LU of I - z J, four z at once with common pivots. A factorisation costs nx dual evaluations and
/// O(nx³), a solve O(nx²). The field must outlive it.
std::unique_ptr<DualResolvent> make_dense_resolvent(DualField& field, size_t nx);

/// GMRES (Saad, Schultz 1986) to a relative residual of 1e-3: two dual evaluations an iteration and
/// lane, J never formed. Preconditioned from the right where a resolvent `about` the same J is
/// given. Both must outlive it.
std::unique_ptr<DualResolvent> make_krylov_resolvent(DualField& field, size_t nx,
                                                     phs::Resolvent* about);

}  // namespace porthos::integrators
