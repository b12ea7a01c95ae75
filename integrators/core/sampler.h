#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "integrators/core/run_model.h"
#include "integrators/core/turns.h"

namespace porthos::integrators {

/// Updates the outputs of a model's sampled controllers at their instants: by counting steps of
/// constant size h, or by the clock. A new sampler resets them to their start.
template <class T>
class Sampler {
 public:
  /// model: a RunModel if it has sampled controllers.
  /// @throws InvalidArgument for a period that is not a whole number of steps, or another model
  Sampler(const phs::Model& model, double h) : holds_(model.holds()) {
    if (holds_.empty()) return;
    const auto* const run = dynamic_cast<const RunModel*>(&model);
    if (!run)
      throw InvalidArgument("'" + model.description().name +
                            "' has sampled controllers, expected a method made by name");
    memories_ = run->memories();
    for (size_t i = 0; i < holds_.size(); ++i) {
      const auto& hold = holds_[i];
      const double steps = hold->period / std::fabs(h);
      if (steps < 0.5 || std::fabs(steps - std::round(steps)) > 1e-9 * steps) {
        const double whole = std::fmax(1.0, std::round(steps)), step = std::fabs(h);
        throw InvalidArgument("the controller '" + hold->name + "' is sampled every " +
                              number(hold->period) + " s, " + number(steps) + " steps of " +
                              number(step) + " s, expected a whole number of them, as at " +
                              number(1 / (whole * step)) +
                              " Hz or with step = " + number(hold->period / whole, 15));
      }
      *memories_[i] = hold->fresh;
      every_.push_back(std::llround(steps));
    }
    before_ = memory();
  }
  bool any() const { return !holds_.empty(); }
  /// Instants are multiples of the periods. Steps may have any size but must end at next_instant().
  void go_by_the_clock() { by_clock_ = true; }
  /// The first multiple of a period after t, in the direction of the run; infinite if there is
  /// none.
  double next_instant(double t, bool backwards) const {
    double next = backwards ? -HUGE_VAL : HUGE_VAL;
    for (const auto& hold : holds_) {
      const double n = t / hold->period;
      next = backwards ? std::fmax(next, (std::ceil(n - near_) - 1) * hold->period)
                       : std::fmin(next, (std::floor(n + near_) + 1) * hold->period);
    }
    return next;
  }
  /// @throws InvalidArgument if there are sampled controllers that count steps
  void refuse(const char* what) const {
    if (any() && !by_clock_)
      throw InvalidArgument("the controller '" + holds_[0]->name + "' is sampled: " + what +
                            " would miss its instants, expected steps of one size");
  }

  /// Call it before the step that begins at this state.
  /// @throws InvalidArgument if steps are no longer counted from time 0, which would miss instants
  void renew(phs::System<T>& system, TurnKeeper<T>& turns, T t, const phs::BasicState<T>& s) {
    before_.clear();
    save(before_);
    if (s.origin_step != 0 && !by_clock_) {
      if (s.origin_step == s.step) return;  // after an odd step, between two instants
      refuse("a step off the grid");
    }
    turns.synchronise(s, system);
    for (size_t i = 0; i < holds_.size(); ++i) {
      if (!renews(i, phs::to_double(t), s)) continue;
      x_.resize(s.x.size());
      for (size_t k = 0; k < x_.size(); ++k) x_[k] = s.x[k] + s.lo[k];
      system.sample(i, t, x_, *memories_[i]);
    }
  }

  /// Whether renew() advances hold i at this state.
  bool renews(size_t i, double t, const phs::BasicState<T>& s) const {
    return (by_clock_ || s.origin_step == 0) && is_instant(i, t, s.step);
  }
  /// What all remembered before the last renewal.
  const std::vector<double>& before() const { return before_; }

  /// Undoes the last renewal, after a step that failed.
  void take_back() { restore(before_); }

  std::vector<double> memory() const {
    std::vector<double> m;
    save(m);
    return m;
  }
  void save(std::vector<double>& m) const {
    for (const auto& own : memories_) m.insert(m.end(), own->begin(), own->end());
  }
  /// @throws InvalidArgument if the size does not fit
  void restore(std::span<const double> m) {
    size_t size = 0;
    for (const auto& own : memories_) size += own->size();
    require_size("memory of the sampled controllers", m.size(), size);
    for (const auto& own : memories_) {
      std::copy_n(m.begin(), own->size(), own->begin());
      m = m.subspan(own->size());
    }
  }

 private:
  bool is_instant(size_t i, double t, std::int64_t step) const {
    if (!by_clock_) return step % every_[i] == 0;
    const double n = t / holds_[i]->period;
    return std::fabs(n - std::round(n)) <= near_;
  }

  static constexpr double near_ = 1e-9;  ///< of a period: rounding of the clock
  bool by_clock_ = false;
  std::vector<phs::HoldPtr> holds_;
  std::vector<RunModel::Memory> memories_;
  std::vector<std::int64_t> every_;  ///< steps between instants
  std::vector<double> before_;       ///< memory before the last renewal
  std::vector<T> x_;
};

}  // namespace porthos::integrators
