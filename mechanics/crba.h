#pragma once
#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Joint-space mass matrix by the composite-rigid-body algorithm, O(n·depth).
/// @param q size nq;  M written, nv × nv column-major, both triangles; zero between branches
/// Allocates nothing.  Source: Featherstone 2008, table 6.2.
template <class T>
void crba(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<T> M);

}  // namespace porthos::mechanics
