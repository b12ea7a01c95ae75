#pragma once
#include <span>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// Loads on a mechanism besides its uniform gravity. An empty span means no load.
template <class T>
struct Loads {
  std::span<const T> tau;  ///< joint forces, size nv [N m | N]
  std::span<const Force<T>>
      wrench;  ///< per moving body, about its frame origin in its own axes [N m; N]
};

/// The O(n) Hamiltonian vector field of H(q, p) = ½ pᵀ M(q)⁻¹ p + V(q), without a mass matrix:
///   q' = ∂H/∂p,   p' = -∂H/∂q + loads
/// @param q, p    state, size nq each (rotation blocks: quaternion and lift)
/// @param q_dot, p_dot  written, size nq each
/// Leaves joint rates in w.rate and body twists in w.V. Allocates nothing. Cost: about one ABA.
/// Source: Featherstone 2008, table 7.1, with p in place of τ; p'_i = h_i · (V_i × S_i), which is
/// ∂T/∂q_i at fixed rates.
template <class T>
void hamiltonian_field(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                       std::span<const T> p, const Loads<T>& loads, std::span<T> q_dot,
                       std::span<T> p_dot);

/// Joint rates v = M(q)⁻¹ p from the flat coordinates q and momenta p. Leaves the rates in w.rate,
/// joint momenta in w.mu, twists in w.V.
template <class T>
void rates_from_momenta(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<const T> p);

}  // namespace porthos::mechanics
