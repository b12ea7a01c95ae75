#pragma once
#include "integrators/core/integrator.h"

namespace porthos::integrators {

struct Entry;

/// The step of most robotics engines: p' = p + h f_p(q, p), then q' = q + h f_q(q, p'), both
/// explicit. Order 1. It is symplectic if f_p does not depend on p, that is for a separable H. With
/// M(q) it is not (the symplectic Euler method would evaluate ∂qH at p'). Damping is evaluated
/// together with the forces. Requires a canonical system.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_semi_implicit_euler(const Declaration&, const phs::Model&,
                                                             T h, const Options&);

/// That method: its stages are where it evaluates f, (q, p) and (q, p') (methods/staged_steps.h).
class SemiImplicitEulerSteps {
 public:
  virtual ~SemiImplicitEulerSteps() = default;
};

std::vector<Entry> semi_implicit_euler_entries();

}  // namespace porthos::integrators
