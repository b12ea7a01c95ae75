#pragma once
#include "integrators/core/integrator.h"
#include "integrators/tables/composition_tables.h"

namespace porthos::integrators {

struct Entry;

/// Splitting methods: the exact flows of the parts of H, one after another.
///
/// The parts are those the system offers (phs::Description::flows), else of a canonical separable H
/// = T(p) + V(q)
///   kick   p -= h ∂V/∂q     drift   q += h ∂T/∂p
/// Time-dependent parts: offered flows keep a clock each; kicks see the time of the drift. Undamped
/// systems only.

/// One flow of a step: part k over coefficient · h.
template <class Real>
struct PartialStep {
  int part;
  Real coefficient;
};
/// Φ(γ_1 h), Φ*(γ_2 h), Φ(γ_3 h), … with Φ = the parts in order, Φ* = the parts in reverse; equal
/// neighbours are merged.
template <class Real>
std::vector<PartialStep<Real>> splitting_program(const std::vector<Real>& gamma, int parts);

/// The splitting with that table of adjoint_compositions(); nullptr: Lie-Trotter.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_splitting(const Declaration&, const CompositionTable*,
                                                   const phs::Model&, T h, const Options&);
/// The explicit Störmer-Verlet method, kick-drift-kick, of a canonical separable system, whatever
/// flows it offers.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_kick_drift_kick(const Declaration&, const phs::Model&, T h,
                                                         const Options&);

std::vector<Entry> splitting_entries();

}  // namespace porthos::integrators
