#pragma once
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "scene/run/run_report.h"
#include "scene/run/state_distance.h"

namespace porthos::scene {

/// One method with one step size, or with one tolerance where it works to one.
struct Setting {
  std::string method;
  double step = 0;  ///< [s]; of a method that works to a tolerance: from output to output
  double rtol = 0;  ///< 0: of no concern
  double iteration_tolerance = 0;  ///< of an implicit method, see integrators::Options
};

/// Where the exact motion is known to be at some time.
struct KnownState {
  double time = 0;             ///< [s]
  std::vector<long double> x;  ///< angles with their turns
};

/// What a trial simulates, and what it is held against.
struct TrialOptions {
  double duration = 0;          ///< [s]; rounded to whole steps
  double cpu_limit = HUGE_VAL;  ///< a trial that needs more is broken off
  std::int64_t records = 256;   ///< states that are measured, at least, where there are as many
  bool repeat = true;           ///< short ones are repeated for their CPU time
  const KnownState* known = nullptr;  ///< compared at the step nearest to its time
  const StateScale* scale = nullptr;  ///< needed with `known`
  const std::atomic<bool>* stop = nullptr;
};

/// A run that is measured, timed and forgotten: nothing is written.
struct Trial {
  Setting setting;
  int timed = 1;            ///< times it was run
  RunReport report;         ///< cpu_s: of stepping alone, of this thread, the least of all repeats
  std::string failure;      ///< why it did not reach the end; empty if it did
  bool broken_off = false;  ///< it failed by the limit or by `stop`, not by itself
  std::optional<double> trajectory_error;
  double early_energy_error = 0;  ///< largest relative energy error in the first half of the time
  double spent_s = 0;             ///< CPU seconds of everything: measuring, repeats
  bool complete() const { return failure.empty(); }
};

/// Takes the time of a complete trial once more, stepping only, and keeps the least. @return CPU
/// seconds spent
double time_again(const Assembly& assembly, Trial& trial);

/// Never throws for what a method does: that is in `failure`.
Trial run_trial(const Assembly& assembly, const Setting& setting, const TrialOptions& options);

}  // namespace porthos::scene
