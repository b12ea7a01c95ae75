#pragma once
#include <optional>
#include <vector>

#include "integrators/core/integrator.h"
#include "scene/compare/trial.h"

namespace porthos::scene {

/// The settings of a method that a comparison tries, one after another: from the first guess to
/// coarser ones until the method breaks down, then to finer ones until rounding dominates. Steps
/// are time/n, so that all end at `time`; methods with a tolerance take relative tolerances from
/// 1e-4 to 1e-13.
class Ladder {
 public:
  /// @param time  [s] that all steps divide;  duration  [s] of a trial;  guess  [s] step of the
  ///   first trial
  Ladder(const integrators::Declaration& method, double time, double duration, double guess);

  const integrators::Declaration& method() const { return method_; }
  /// The next setting; empty when all useful settings have been tried.
  std::optional<Setting> next() const;
  /// Estimated CPU seconds of the next trial, from the previous ones; 0 for the first.
  double predicted_s() const;
  double spent_s() const { return spent_; }
  /// Takes the result of a trial of next(). error: the error that is compared; NaN if there is
  /// none.
  void take(const Trial& trial, double error);
  /// Adds to what the method has cost.
  void also_spent(double cpu_s) { spent_ += cpu_s; }
  /// No more trials.
  void end() { phase_ = Phase::done; }

 private:
  enum class Phase { first, coarser, finer, done };
  struct Rung {
    std::int64_t n;  ///< steps in `time`, or -log10 of the tolerance
    double error, cpu_s;
    bool good;  ///< reached the end with an error below 1
  };
  void coarser(const Rung& r);
  void finer(const Rung& r);
  std::int64_t below(std::int64_t n) const;
  std::int64_t above(std::int64_t n) const;
  void seek(Phase phase, std::int64_t n) {
    phase_ = phase;
    n_ = n;
  }

  integrators::Declaration method_;
  bool tolerance_;  ///< rungs are tolerances
  double time_, duration_, ratio_;
  std::int64_t n_, fewest_;
  Phase phase_ = Phase::first;
  std::vector<Rung> rungs_;
  double spent_ = 0, best_ = HUGE_VAL;
  int no_better_ = 0, bad_ = 0;
};

}  // namespace porthos::scene
