#pragma once
#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Generalised RATTLE: Störmer-Verlet on the manifold of constraints, for a mass matrix that
/// depends on q. Order 2, symmetric, symplectic along the manifold, implicit. With v = ∂pH:
///   p½ = p - (h/2)(∂qH(q, p½) + Gᵀλ),  q' = q + (h/2)(v(q, p½) + v(q', p½)),  g(q') = 0
///   p' = p½ - (h/2)(∂qH(q', p½) + G'ᵀμ),  G' v(q', p') = 0
/// Source: Hairer, Lubich, Wanner 2006, VII.1.4. Quaternions have multipliers of their own
/// (unit_quaternions.h). It keeps bilinear invariants such as momenta, and norms of quaternions, to
/// rounding. Requires a canonical lossless system.
Entries rattle_entries();

}  // namespace porthos::integrators
