#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Generalised Störmer-Verlet for H(q, p) with a mass matrix that depends on q: order 2, symmetric,
/// symplectic, implicit.
///   p½ = p - (h/2) ∂qH(q, p½),  q' = q + (h/2)(∂pH(q, p½) + ∂pH(q', p½)),  p' = p½ - (h/2) ∂qH(q',
///   p½)
/// (Hairer, Lubich, Wanner 2006, VI.3). On a quaternion block ξ this alone does not conserve |ξ| =
/// 1: there the kicks have a multiplier (unit_quaternions.h; RATTLE, op. cit. VII.1.4). For a
/// separable H = T(p) + V(q) the same map is explicit and computed as kick-drift-kick
/// (splitting.h). Requires a canonical lossless system, x = (q, p).
std::vector<Entry> stormer_verlet_entries();

}  // namespace porthos::integrators
