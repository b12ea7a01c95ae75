#pragma once
#include <span>
#include <vector>

#include "integrators/core/inside.h"
#include "phs/system/system.h"

namespace porthos::integrators {

/// The energy balance of one step: ∫ power dt [J] of each of a system's powers. It uses the
/// method's own weights if the method integrates the powers itself (Kotyczka, Lefevre 2019).
/// Otherwise it uses two Gauss points on the cubic through both ends of the step. They lie inside
/// it, so they see the right side of a thruster that switches at its ends.
template <class T>
class PortWork {
 public:
  /// on: whether to integrate the powers at all
  explicit PortWork(const phs::Description& d, bool on = true)
      : power_(on ? d.powers.size() : 0), of_step_(power_.size()) {
    if (!any()) return;
    e_.resize(size_t(d.nx));
    x0_.resize(e_.size());
    f0_.resize(e_.size());
    x1_.resize(e_.size());
    f1_.resize(e_.size());
    between_.resize(e_.size());
  }
  bool any() const { return !of_step_.empty(); }
  std::span<const T> of_step() const { return of_step_; }

  void restart() { std::fill(of_step_.begin(), of_step_.end(), T(0.0)); }
  void add(size_t account, T energy) { of_step_[account] += energy; }
  void add(std::span<const T> energies) {
    for (size_t a = 0; a < of_step_.size(); ++a) of_step_[a] += energies[a];
  }
  /// weight · power at a point x where field = dx.
  void add(phs::System<T>& s, T t, T weight, std::span<const T> x, std::span<const T> dx) {
    s.efforts(t, x, dx, e_);
    add_at(s, t, weight, x, e_);
  }
  /// weight · power at x with the efforts e.
  void add_at(phs::System<T>& s, T t, T weight, std::span<const T> x, std::span<const T> e) {
    s.powers(t, x, e, power_);
    for (size_t a = 0; a < of_step_.size(); ++a) of_step_[a] += weight * power_[a];
  }

  /// For methods that do not integrate powers: call it before a step, with the state in x + lo.
  void before(phs::System<T>& s, T t, T h, const std::vector<T>& x, const std::vector<T>& lo) {
    for (size_t i = 0; i < x.size(); ++i) x0_[i] = x[i] + lo[i];
    s.field(t + hair(t, h), x0_, {}, f0_);
  }
  void after(phs::System<T>& s, T t, T h, const std::vector<T>& x, const std::vector<T>& lo) {
    for (size_t i = 0; i < x.size(); ++i) x1_[i] = x[i] + lo[i];
    s.field(t + h - hair(t, h), x1_, {}, f1_);
    restart();
    for (const double c : {0.5 - 0.28867513459481287, 0.5 + 0.28867513459481287}) {  // 1/√12
      const T from_0(c), from_1(1 - c);
      for (size_t i = 0; i < x.size(); ++i)
        between_[i] = x0_[i] + from_0 * from_0 * (T(3.0) - T(2.0) * from_0) * (x1_[i] - x0_[i]) +
                      h * from_0 * from_1 * (from_1 * f0_[i] - from_0 * f1_[i]);
      s.gradient(between_, e_);
      add_at(s, t + from_0 * h, T(0.5) * h, between_, e_);
    }
  }

 private:
  std::vector<T> power_, of_step_, e_, x0_, f0_, x1_, f1_, between_;
};

}  // namespace porthos::integrators
