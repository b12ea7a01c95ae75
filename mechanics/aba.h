#pragma once
#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Forward dynamics by the articulated-body algorithm, O(n): M(q) v̇ + C(q, v) v + ∂V/∂q = τ +
/// loads. M is never formed.
/// @param q  configuration, size nq;  v  joint rates, size nv [rad/s | m/s];  vdot  written, size
///   nv: accelerations; for a free or ball joint, the time derivatives of the components of its
///   body-frame twist
/// @param loads  joint forces and body wrenches
/// Allocates nothing.  Source: Featherstone 2008, table 7.1.
template <class T>
void aba(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> v,
         const Loads<T>& loads, std::span<T> vdot);

}  // namespace porthos::mechanics
