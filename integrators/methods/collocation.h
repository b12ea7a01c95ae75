#pragma once
#include <memory>
#include <type_traits>

#include "integrators/core/integrator.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// What a table is made of for steps in T.
template <class T>
using TableReal = std::conditional_t<std::is_same_v<T, phs::Quad>, phs::Quad, double>;

/// The step of every method that a CollocationTable describes: Gauss, HBVM, Lobatto pairs. All
/// stages at once, as SIMD lanes; iterated to stagnation from the extrapolated polynomial of the
/// step before; compensated state. A table with mu_p needs a canonical system.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_collocation(const Declaration& declaration,
                                                     CollocationTable<TableReal<T>> table,
                                                     const phs::Model& model, T h,
                                                     const Options& options);

}  // namespace porthos::integrators
