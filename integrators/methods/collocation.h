#pragma once
#include <memory>
#include <type_traits>

#include "integrators/core/integrator.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// The number type of the tables for steps in T.
template <class T>
using TableReal = std::conditional_t<std::is_same_v<T, phs::Quad>, phs::Quad, double>;

/// The step of every method that a CollocationTable describes: Gauss, HBVM, Lobatto pairs. It
/// evaluates all stages at once as SIMD lanes, and iterates to stagnation from the extrapolated
/// polynomial of the last step. The state is compensated. A table with mu_p requires a canonical
/// system.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_collocation(const Declaration& declaration,
                                                     CollocationTable<TableReal<T>> table,
                                                     const phs::Model& model, T h,
                                                     const Options& options);

}  // namespace porthos::integrators
