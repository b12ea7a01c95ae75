#pragma once
#include <cstdint>
#include <memory>

#include "phs/system.h"

/// Resolvents for systems that offer none of their own. J comes from dual evaluations of the field.
namespace porthos::integrators {

/// A resolvent that counts the field evaluations it makes.
class DualResolvent : public phs::Resolvent {
 public:
  virtual std::int64_t evaluations() const = 0;
};

/// LU of I - z J, four z at once with common pivots. A factorisation costs nx dual evaluations and O(nx³), a solve O(nx²).
/// The system must outlive it.
std::unique_ptr<DualResolvent> make_dense_resolvent(phs::System<phs::Dual>& system);

/// GMRES (Saad, Schultz 1986) to a relative residual of 1e-3: two dual evaluations an iteration and lane, J never
/// formed. Preconditioned from the right where a resolvent `about` the same J is given. Both must outlive it.
std::unique_ptr<DualResolvent> make_krylov_resolvent(phs::System<phs::Dual>& system,
                                                     phs::Resolvent* about);

}  // namespace porthos::integrators
