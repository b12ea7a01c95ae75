#pragma once
#include <memory>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/system/resolvent.h"

namespace porthos::mechanics {

/// (I - z J)⁻¹ r in O(n). J is the exact Jacobian of a mechanism's field with its joint springs and
/// dampers.
///
/// The field is a recursion over the tree, so its linearisation is one too. A body passes the
/// variation s = (δV, δγ) of twist and gravity to its child. The child returns the variation of the
/// momentum and weight of its subtree, f = (δh, δg) = P s + c. A joint is eliminated as in the
/// articulated-body algorithm: D gains z²K + z d + J from its spring, damper and rotor, and P ← P -
/// κ D⁻¹ σᵀ goes to the parent. Everything is in world axes about one point, so there are no
/// transforms. `turn_angle` is read at each factorisation; both references must outlive the solver.
std::unique_ptr<phs::Resolvent> make_resolvent(const Mechanism& m,
                                               const std::vector<double>& turn_angle);

}  // namespace porthos::mechanics
