#pragma once
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "integrators/control/step_control.h"
#include "scene/run/run_report.h"
#include "scene/run/state_distance.h"

namespace porthos::scene {

/// One method with one step size, or with one tolerance if it takes one.
struct Setting {
  std::string method;
  double step = 0;                 ///< [s]; of a method with a tolerance: interval between outputs
  double rtol = 0;                 ///< 0: not used
  double iteration_tolerance = 0;  ///< of an implicit method, see integrators::Options
  integrators::StepControl control = integrators::StepControl::fixed;
  double control_rate = 0;            ///< [rad/s], see integrators::ControlOptions
  double control_length = 0;          ///< [m]
  std::vector<double> instants = {};  ///< [s], at which steps of a control end, in order
};

/// The switches of a scene's thrusters and more instants, in order: Setting::instants.
std::vector<double> switches_and(const Scene& scene, std::initializer_list<double> more);

/// A state of the exact motion that is known at some time.
struct KnownState {
  double time = 0;             ///< [s]
  std::vector<long double> x;  ///< angles with their turns
};

/// What a trial simulates, and its reference.
struct TrialOptions {
  double duration = 0;                ///< [s]; rounded to whole steps
  double cpu_limit = HUGE_VAL;        ///< a trial that needs more is stopped
  std::int64_t records = 256;         ///< fewest measured states, if there are as many
  bool repeat = true;                 ///< short ones are repeated for their CPU time
  const KnownState* known = nullptr;  ///< compared at the step nearest to its time
  const StateScale* scale = nullptr;  ///< needed with `known`
  const std::atomic<bool>* stop = nullptr;
};

/// A run that is measured and timed; nothing is written.
struct Trial {
  Setting setting;
  int timed = 1;            ///< number of timings
  RunReport report;         ///< cpu_s: of stepping alone, of this thread, the least of all repeats
  std::string failure;      ///< why it did not reach the end; empty if it did
  bool broken_off = false;  ///< it was stopped by the limit or by `stop`
  bool refused = false;     ///< `failure` is an error that was thrown, as by a method of one's own
  std::optional<double> trajectory_error;
  double early_energy_error = 0;  ///< largest relative energy error in the first half of the time
  double spent_s = 0;             ///< CPU seconds of everything: measuring, repeats
  bool complete() const { return failure.empty(); }
};

/// The power of the step by which the trajectory's error falls between two trials of a method: the
/// experimental order of convergence. None where one of them has no such error, and for trials over
/// tolerances.
std::optional<double> observed_order(const Trial& coarse, const Trial& fine);

/// Times a complete trial once more, stepping only, and keeps the smallest time. @return CPU
/// seconds spent
double time_again(const Assembly& assembly, Trial& trial);

/// Does not throw for a failure of the method: that is in `failure`.
Trial run_trial(const Assembly& assembly, const Setting& setting, const TrialOptions& options);

}  // namespace porthos::scene
