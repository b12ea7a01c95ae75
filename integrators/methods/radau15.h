#pragma once
#include <memory>

#include "integrators/core/integrator.h"

namespace porthos::integrators {

struct Entry;

/// Gauss-Radau of order 15 for x' = f(t, x): collocation at the left Radau nodes (Everhart 1985),
/// which suits ports, dampers and drives of any kind. It keeps no structure: it is accurate
/// instead.
///
/// advance(t, h) takes as many steps of its own as accuracy to round-off asks for, after the last
/// coefficient of the polynomial through the eight rates (Rein and Spiegel 2015, MNRAS 446, 1424,
/// eq. 8 to 11), with the size of each component by the way it goes in the step. Start values are
/// the extrapolated polynomial; sweeps of all stages at once go on to stagnation; the state is
/// compensated. Step size and polynomial are in memory().
///
/// adaptive = false takes every advance() as one step: the bare formula, order 15, for tests.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_radau15(const Declaration&, const phs::Model&, T h,
                                                 const Options&, bool adaptive = true);

std::vector<Entry> radau15_entries();

}  // namespace porthos::integrators
