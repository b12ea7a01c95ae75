#pragma once
#include "integrators/integrator.h"

namespace porthos::integrators {

/// SUNDIALS CVODE on the same flat state: the independent rival. Works to Options::rtol and atol; a "step" of length h is
/// as many inner steps as CVODE likes, stopped exactly at its end. Angles are not wrapped and low words stay zero.
std::unique_ptr<Integrator> make_cvode_adams(const Declaration&, const phs::Model&, double h,
                                             const Options&);
std::unique_ptr<Integrator> make_cvode_bdf(const Declaration&, const phs::Model&, double h,
                                           const Options&);

}  // namespace porthos::integrators
