#pragma once
#include "integrators/integrator.h"

namespace porthos::integrators {

/// The classical Runge-Kutta method, order 4: a baseline that keeps nothing.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_rk4(const Declaration&, const phs::Model&, T h,
                                             const Options&);

}  // namespace porthos::integrators
