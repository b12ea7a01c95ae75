#pragma once
#include <memory>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/system/resolvent.h"

namespace porthos::mechanics {

/// (I - z J)⁻¹ r in O(n), J the exact Jacobian of a mechanism's field with its joint springs and
/// dampers.
///
/// The field is a recursion over the tree, hence its linearisation too. A body hands its child the
/// variation s = (δV, δγ) of twist and gravity; the child answers with that of its subtree's
/// momentum and weight, f = (δh, δg) = P s + c. A joint is eliminated like one of the
/// articulated-body algorithm: D gains z²K + z d + J from its spring, damper and rotor, and P ← P
/// κ D⁻¹ σᵀ goes to the parent. All in world axes about one point: no transforms. Turn angles are
/// read from `turn_angle` at each factorisation; both references must outlive the solver.
std::unique_ptr<phs::Resolvent> make_resolvent(const Mechanism& m,
                                               const std::vector<double>& turn_angle);

}  // namespace porthos::mechanics
