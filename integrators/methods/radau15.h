#pragma once
#include <memory>

#include "integrators/core/integrator.h"

namespace porthos::integrators {

struct Entry;

/// Gauss-Radau of order 15 for x' = f(t, x): collocation at the left Radau nodes (Everhart 1985),
/// suitable for any ports, dampers and drives. It preserves no structure but is accurate.
///
/// advance(t, h) takes as many internal steps as accuracy to round-off requires. The step size
/// follows the last coefficient of the polynomial through the eight rates (Rein and Spiegel 2015,
/// MNRAS 446, 1424, eq. 8 to 11), with each component scaled by its change over the step. Start
/// values come from the extrapolated polynomial. Sweeps of all stages at once continue to
/// stagnation. The state is compensated. Step size and polynomial are in memory().
///
/// adaptive = false takes every advance() as one step: the plain formula of order 15, for tests.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_radau15(const Declaration&, const phs::Model&, T h,
                                                 const Options&, bool adaptive = true);

std::vector<Entry> radau15_entries();

}  // namespace porthos::integrators
