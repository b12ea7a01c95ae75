#pragma once
#include <algorithm>
#include <chrono>

namespace porthos::scene {

/// Says when to read the clock: after a number of steps that takes about a hundredth of a second.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  bool due() {
    if (--left_ > 0) return false;
    const Clock::time_point now = Clock::now();
    const double passed = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    every_ = passed < 0.005  ? std::min(2 * every_, 1 << 20)
             : passed > 0.02 ? std::max(1, every_ / 2)
                             : every_;
    left_ = every_;
    return true;
  }

 private:
  int every_ = 1, left_ = 1;
  Clock::time_point last_ = Clock::now();
};

}  // namespace porthos::scene
