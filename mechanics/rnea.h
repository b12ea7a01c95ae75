#pragma once
#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Inverse dynamics by the recursive Newton-Euler algorithm, O(n):
/// τ = M(q) v̇ + C(q, v) v + ∂V/∂q - wrench terms.
/// @param q size nq;  v, vdot size nv (empty: zero);  wrench per moving body (empty: none);  tau
///   written, size nv
/// Allocates nothing.  Source: Featherstone 2008, table 5.1, with the world accelerated by -g.
template <class T>
void rnea(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> v,
          std::span<const T> vdot, std::span<const Force<T>> wrench, std::span<T> tau);

}  // namespace porthos::mechanics
