#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

/// The values of a network's controllers, in T.
template <class T>
class ControlValues {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit ControlValues(const Network::Plan& p) : p_(p), held_(p.controls.size()) {
    size_t state = 0, size = 0, seen = 0;
    for (size_t j = 0; j < p.controls.size(); ++j) {
      const auto& c = p.controls[j];
      state = std::max(state, p.seen(c).second);
      size = std::max(size, size_t(c.size));
      seen = std::max(seen, size_t(c.size) + c.sensors.size());
      if (!c.hold) continue;
      sampled_.push_back(j);
      held_[j] = HeldPtr(c.hold, &c.hold->fresh);
    }
    state_.resize(state);
    plain_.resize(state);
    kappa_.resize(size);
    seen_.resize(seen);
  }

  void use_held(std::span<const HeldPtr> memories) {
    for (size_t i = 0; i < sampled_.size(); ++i) held_[sampled_[i]] = memories[i];
  }
  void use_held(const ControlValues& other) { held_ = other.held_; }
  /// How many have a hold, and the control of hold number i.
  size_t sampled() const { return sampled_.size(); }
  size_t sampled(size_t i) const { return sampled_[i]; }
  /// Of all holds.
  std::vector<HeldPtr> memories() const {
    std::vector<HeldPtr> all;
    for (const size_t j : sampled_) all.push_back(held_[j]);
    return all;
  }
  /// What control j holds.
  T held(size_t j, size_t k) const { return T((*held_[j])[k]); }
  Out held(size_t j) {
    const Out own = Out(kappa_).first(size_t(p_.controls[j].size));
    for (size_t k = 0; k < own.size(); ++k) own[k] = held(j, k);
    return own;
  }

  /// Place for the unwrapped state that control j's law sees, to be filled before law() and
  /// renew().
  Out state(size_t j) { return Out(state_).first(p_.seen(p_.controls[j]).second); }
  /// κ of control j, 0 behind a closed gate. y: the flows at all ports
  Out law(size_t j, T t, In y) { return law(j, t, y, held_[j] ? *held_[j] : none_); }
  /// Renews what control j holds at a sampling instant; its encoder is read already.
  void renew(size_t j, T t, In y, std::span<double> memory) {
    const auto& c = p_.controls[j];
    if (c.gate) {
      const Out x = state(j);
      for (size_t k = 0; k < x.size(); ++k) plain_[k] = to_double(x[k]);
      c.gate->renew(to_double(t), std::span<const double>(plain_).first(x.size()),
                    memory.subspan(c.gate_at()));
    }
    const Out kappa = law(j, t, y, memory);
    for (size_t k = 0; k < kappa.size(); ++k) memory[k] = to_double(kappa[k]);
  }

 private:
  Out law(size_t j, T t, In y, std::span<const double> memory) {
    const auto& c = p_.controls[j];
    const auto n = size_t(c.size);
    const Out kappa = Out(kappa_).first(n), seen = Out(seen_).first(n + c.sensors.size());
    if (c.gate && !c.gate->open(memory.subspan(c.gate_at()))) {
      std::fill(kappa.begin(), kappa.end(), T(0.0));
      return kappa;
    }
    std::copy_n(y.begin() + c.row, n, seen.begin());
    for (size_t k = 0; k < c.sensors.size(); ++k) seen[n + k] = y[size_t(c.sensors[k])];
    (*c.law)(t, In(state(j)), In(seen), kappa);
    return kappa;
  }

  const Network::Plan& p_;
  const std::vector<double> none_ = {};
  std::vector<T> state_, kappa_, seen_;
  std::vector<double> plain_;    ///< the state as a gate sees it
  std::vector<size_t> sampled_;  ///< the controls with a hold
  std::vector<HeldPtr> held_;    ///< by control; set where it has a hold
};

}  // namespace porthos::phs
