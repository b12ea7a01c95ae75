#pragma once
#include <memory>

#include "integrators/gauss_table.h"
#include "integrators/integrator.h"

namespace porthos::integrators {

struct Entry;

/// Gauss collocation with s = 1 … 8 stages (12 in Quad), order 2s: symplectic, symmetric, keeps quadratic invariants.
/// Iterated to stagnation from the extrapolated collocation polynomial, by fixed point or Newton (Options::solver);
/// compensated state; wrapped angles.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_gauss(Declaration declaration, int s,
                                               const phs::Model& model, T h,
                                               const Options& options);
/// The same with a given table, for negative controls.
std::unique_ptr<Integrator> make_gauss(Declaration declaration, GaussTable<double> table,
                                       const phs::Model& model, double h, const Options& options);

std::vector<Entry> gauss_entries();

/// A reference run in 113-bit arithmetic: steps of size h with s stages from x (size nx), fixed-point to stagnation.
/// Angles are not wrapped. Returns the state after `steps`. Slow (a software float): for tests and `compare`.
/// @throws InvalidArgument if the iteration does not converge
std::vector<phs::Quad> gauss_reference(const phs::Model& model, std::vector<phs::Quad> x,
                                       phs::Quad h, std::int64_t steps, int s = 12);

}  // namespace porthos::integrators
