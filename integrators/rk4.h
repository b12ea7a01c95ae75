#pragma once
#include "integrators/integrator.h"

namespace porthos::integrators {

/// The classical explicit Runge-Kutta method of order 4: what many users come from. It keeps no structure.
std::unique_ptr<Integrator> make_rk4(const Declaration&, const phs::Model&, double h,
                                     const Options&);

}  // namespace porthos::integrators
