#pragma once
#include "integrators/core/integrator.h"
#include "integrators/tables/composition_tables.h"

namespace porthos::integrators {

struct Entry;

/// Splitting methods: the exact flows of the parts of H, one after another.
///
/// The parts are those that the system offers (phs::Description::flows). Otherwise they are those
/// of a canonical separable H = T(p) + V(q):
///   kick   p -= h ∂V/∂q     drift   q += h ∂T/∂p
/// Time-dependent parts: each offered flow has its own clock; kicks use the time of the drift. For
/// undamped systems only.

/// One flow of a step: part k over the time coefficient · h.
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
/// The explicit Störmer-Verlet method (kick-drift-kick) for a canonical separable system, even if
/// it offers other flows.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_kick_drift_kick(const Declaration&, const phs::Model&, T h,
                                                         const Options&);

std::vector<Entry> splitting_entries();

}  // namespace porthos::integrators
