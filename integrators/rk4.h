#pragma once
#include "integrators/integrator.h"
#include "integrators/lane_integrator.h"

namespace porthos::integrators {

struct Entry;

/// The classical Runge-Kutta method, order 4: a baseline that keeps nothing.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_rk4(const Declaration&, const phs::Model&, T h,
                                             const Options&);

/// A state per lane.
std::unique_ptr<LaneIntegrator> make_lane_rk4(const phs::Model&, double h, const Options&);

std::vector<Entry> rk4_entries();

}  // namespace porthos::integrators
