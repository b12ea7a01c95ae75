#pragma once
#include <memory>

#include "phs/network/detail/network_plan.h"
#include "phs/system/linearised.h"

namespace porthos::phs {

/// The derivative of a network's field from those of its members, where everything joined acts on
/// inputs that add to one momentum each (Linearised::input): springs, dampers, sources, and
/// couplings of such ports.
///
/// With rates r of the members' field f, the network's is f + N(r), N adding B r + v - law(r) to
/// momenta. So Dfᵀλ = Df_membersᵀ(λ + DNᵀλ): one product of each member.
///
/// Parameters: those of the members; then one "<element>.factor" for each spring, law and source: a
/// factor on its force, 1 in this model. So the derivative by a linear spring's constant is that of
/// its factor divided by it.
///
/// Returns null where a port turns with the state, or a controller, a spring on a block of several
/// numbers or a feedthrough takes part.
/// plan: must outlive the result.
template <class T>
std::unique_ptr<Linearised<T>> make_network_linearised(const Network::Plan& plan);

/// The same for any scalar: null also for those that Linearised is not there for.
template <class T>
std::unique_ptr<Linearised<T>> network_linearised(const Network::Plan& plan) {
  if constexpr (has_linearised<T>) return make_network_linearised<T>(plan);
  return nullptr;
}

}  // namespace porthos::phs
