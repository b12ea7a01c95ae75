#pragma once
#include "integrators/core/integrator.h"

namespace porthos::integrators {

struct Entry;

/// Gauss collocation with s = 1 … 8 stages, order 2s: symplectic, symmetric, keeps quadratic
/// invariants.
std::vector<Entry> gauss_entries();

/// A reference run in 113-bit arithmetic: steps of size h with s stages from x (size nx),
/// fixed-point to stagnation. Angles are not wrapped. Returns the state after `steps`. Slow (a
/// software float): for tests and `compare`.
/// @throws InvalidArgument if the iteration does not converge
std::vector<phs::Quad> gauss_reference(const phs::Model& model, std::vector<phs::Quad> x,
                                       phs::Quad h, std::int64_t steps, int s = 12);

}  // namespace porthos::integrators
