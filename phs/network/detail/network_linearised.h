#pragma once
#include <memory>

#include "phs/network/detail/control_values.h"
#include "phs/network/detail/network_plan.h"
#include "phs/network/detail/sampled_controls.h"
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
/// its factor divided by it. Last the values that sampled controllers hold, which are constants
/// here.
///
/// Returns null where a port turns with the state, or a continuous controller, a tank, a spring on
/// a block of several numbers or a feedthrough takes part.
/// plan: must outlive the result; memories: of all holds, in their order
template <class T>
std::unique_ptr<Linearised<T>> make_network_linearised(const Network::Plan& plan,
                                                       std::vector<HeldPtr> memories);

/// The same for any scalar T: null also for those that Linearised is not there for. The memories
/// are those of an evaluator.
template <class T, class S>
std::unique_ptr<Linearised<T>> network_linearised(const Network::Plan& plan,
                                                  const ControlValues<S>& controls,
                                                  const SampledControls<S>& with_memory) {
  if constexpr (has_linearised<T>) {
    std::vector<HeldPtr> memories = controls.memories();
    memories.insert(memories.end(), with_memory.memories().begin(), with_memory.memories().end());
    return make_network_linearised<T>(plan, std::move(memories));
  }
  return nullptr;
}

}  // namespace porthos::phs
