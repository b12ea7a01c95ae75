#pragma once
#include <span>
#include <vector>

#include "phs/network/detail/tank_flows.h"

namespace porthos::phs {

/// The controllers of a network whose laws have a memory, in one run. Private to network*.cpp.
template <class T>
class SampledControls {
  using Plan = Network::Plan;
  using In = std::span<const T>;

 public:
  explicit SampledControls(const std::vector<Plan::SampledControl>& controls)
      : controls_(controls) {
    for (const auto& c : controls) memories_.emplace_back(c.hold, &c.hold->fresh);
  }
  void use(std::span<const HeldPtr> memories) {
    memories_.assign(memories.begin(), memories.end());
  }
  const std::vector<HeldPtr>& memories() const { return memories_; }

  /// v += the held values, by the factor of the tank that pays.
  void add(In x, In e, const std::vector<T>& y, TankFlows<T>& tanks, std::vector<T>& v) const {
    for (size_t i = 0; i < controls_.size(); ++i) {
      const int tank = controls_[i].tank;
      const T factor = tank < 0 ? T(1.0) : tanks.pay(tank, x, e, power(i, y));
      for (size_t k = 0; k < controls_[i].rows.size(); ++k) {
        T& at = v[size_t(controls_[i].rows[k])];
        at = at + factor * T((*memories_[i])[k]);
      }
    }
  }
  /// The power of each, from place `to` on. @return the place after them
  size_t powers(In x, In e, const std::vector<T>& y, const TankFlows<T>& tanks, std::span<T> values,
                size_t to) const {
    for (size_t i = 0; i < controls_.size(); ++i)
      values[to++] = tanks.factor(controls_[i].tank, x, e) * power(i, y);
    return to;
  }
  /// Evaluates law i. unwrapped(k): number k of the network's state, with its angle unwrapped.
  template <class Unwrapped>
  void sample(size_t i, T t, Unwrapped unwrapped, const std::vector<T>& y, std::span<double> memory,
              const Plan& plan) {
    const auto& c = controls_[i];
    const auto& m = plan.members[size_t(c.member)];
    x_.resize(size_t(m.nx));
    for (size_t k = 0; k < x_.size(); ++k) x_[k] = to_double(unwrapped(size_t(m.x) + k));
    y_.clear();
    for (const int row : c.rows) y_.push_back(to_double(y[size_t(row)]));
    const size_t held = y_.size();
    if (c.tank >= 0) y_.push_back(to_double(unwrapped(size_t(plan.tanks[size_t(c.tank)].x))));
    (*c.law)(to_double(t), x_, y_, memory.subspan(held), memory.first(held));
  }

 private:
  T power(size_t i, const std::vector<T>& y) const {
    T sum(0.0);
    for (size_t k = 0; k < controls_[i].rows.size(); ++k)
      sum = sum + T((*memories_[i])[k]) * y[size_t(controls_[i].rows[k])];
    return sum;
  }

  const std::vector<Plan::SampledControl>& controls_;
  std::vector<HeldPtr> memories_;
  std::vector<double> x_, y_;
};

}  // namespace porthos::phs
