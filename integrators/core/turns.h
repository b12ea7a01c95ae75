#pragma once
#include <vector>

#include "phs/system/state.h"
#include "phs/system/system.h"

namespace porthos::integrators {

/// Passes the turn counts of a state to a system when they have changed.
template <class T>
class TurnKeeper {
 public:
  explicit TurnKeeper(const phs::Description& d)
      : told_(size_t(d.angle_count()), 0), angles_(told_.size()) {}

  /// Calls tell(2π·turns) if they have changed.
  template <class Tell>
  void when_changed(const std::vector<std::int64_t>& turns, const Tell& tell) {
    if (turns == told_) return;
    std::copy(turns.begin(), turns.end(), told_.begin());
    for (size_t i = 0; i < told_.size(); ++i) angles_[i] = T(double(told_[i]) * phs::two_pi_hi);
    tell(std::span<const T>(angles_));
  }
  void synchronise(const std::vector<std::int64_t>& turns, phs::System<T>& system) {
    when_changed(turns, [&](std::span<const T> angles) { system.set_turn_angles(angles); });
  }
  template <class S>
  void synchronise(const phs::BasicState<S>& s, phs::System<T>& system) {
    synchronise(s.turns, system);
  }

 private:
  std::vector<std::int64_t> told_;
  std::vector<T> angles_;
};

}  // namespace porthos::integrators
