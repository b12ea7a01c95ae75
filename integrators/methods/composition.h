#pragma once
#include "integrators/core/integrator.h"
#include "integrators/tables/composition_tables.h"

namespace porthos::integrators {

struct Entry;

/// Ψ(γ_s h) ∘ … ∘ Ψ(γ_1 h) of a symmetric method Ψ of the catalogue, the base. It conserves what
/// each base step conserves. The error expansion of a symmetric base has odd powers of h only, so
/// few conditions on γ raise the order.
/// @throws InvalidArgument if the base does not declare itself symmetric and of even order
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_composition(const Declaration&, const CompositionTable&,
                                                     const std::string& base, const phs::Model&,
                                                     T h, const Options&);

std::vector<Entry> composition_entries();

}  // namespace porthos::integrators
