#pragma once
#include <memory>
#include <span>
#include <vector>

#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

/// (I - z J)⁻¹ r of a network from its members' own resolvents. J = J0 + G V: J0 is that of the
/// members alone, G has the columns of the state-dependent inputs, V = ∂u/∂x. With A = I - z J0
/// (Woodbury),
///
///   d = a + W S⁻¹ z V a,   a = A⁻¹r,   W = A⁻¹G,   S = I - z V W.
///
/// u = B y + M v(x, y), y = Gᵀ ∂H/∂x. Row k of ∂y/∂x is ∂²H g_k: one gradient in duals along g_k.
/// Springs of a network are inputs along a momentum. The dependence of G on x is neglected, so J is
/// not exact where the ports rotate with the state.
///
/// A small member without a resolvent is solved by LU. Cost of m inputs beyond the members' own
/// cost: m solves, m dual gradients and O(m² nx) per factorisation, O(m nx) per solve. A continuous
/// controller costs one dual evaluation of its law per state.
///
/// `systems` are the members and `turns` the turn angles of the network's evaluator, which must
/// outlive the result. Returns nullptr if no member has a resolvent, a member without one is large,
/// a gradient has no duals, or m is above 128.
std::unique_ptr<Resolvent> make_network_resolvent(
    const Network::Plan& plan, std::span<const std::unique_ptr<System<double>>> systems,
    const std::vector<double>& turns);

}  // namespace porthos::phs
