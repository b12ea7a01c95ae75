#pragma once
#include <memory>
#include <span>
#include <vector>

#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

/// (I - z J)⁻¹ r of a network by its members' own resolvents, J = J0 + G V: J0 of the members
/// apart, G the columns of the
/// inputs that depend on the state, V = ∂u/∂x. With A = I - z J0 (Woodbury),
///
///   d = a + W S⁻¹ z V a,   a = A⁻¹r,   W = A⁻¹G,   S = I - z V W.
///
/// u = B y + M v(x, y), y = Gᵀ ∂H/∂x: row k of ∂y/∂x is ∂²H g_k, one gradient in duals along g_k.
/// Springs of a network are inputs along a momentum. What G(x) changes with x is left out: J is not
/// exact where ports turn with the state.
///
/// A member without a resolvent is solved by LU if it is small. Cost of m inputs over the members':
/// m solves, m dual gradients and O(m² nx) a factorisation, O(m nx) a solve; continuous controllers
/// take one dual evaluation of the law per state.
///
/// `systems` are the members and `turns` the turn angles, both of the network's evaluator, which
/// must outlive it. nullptr where no member has a resolvent, a member without one is large, a
/// gradient has no duals, or m is above 128.
std::unique_ptr<Resolvent> make_network_resolvent(
    const Network::Plan& plan, std::span<const std::unique_ptr<System<double>>> systems,
    const std::vector<double>& turns);

}  // namespace porthos::phs
