#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"
#include "scene/compare/lyapunov.h"
#include "scene/compare/reference_state.h"
#include "scene/compare/trial.h"

/// Speed against error: every applicable method, over a range of steps or tolerances.
namespace porthos::scene {

/// Trajectories are compared until a deviation has grown by this factor.
inline constexpr double trajectory_growth = 1e4;

/// Methods and duration of a comparison.
struct CompareOptions {
  std::vector<std::string> methods = {};  ///< names of the catalogue; empty: all that fit
  double budget_s = 120;                  ///< CPU seconds for everything
  /// [s]; if not given, the scene's, shortened if the budget asks for it
  std::optional<double> duration = {};
  const std::atomic<bool>* stop = nullptr;  ///< set by Ctrl-C: return the results so far
  /// Fraction done, wall seconds spent, wall seconds left at most.
  std::function<void(double, double, double)> progress = {};
};

/// The trials of one method, from coarse to fine.
struct MethodTrials {
  integrators::Declaration method;
  std::vector<Trial> trials;
  bool cut_short = false;  ///< finer trials did not fit into the budget
  /// Each trial repeats one of the same method above, with its sweeps stopped at the error of that
  /// one.
  bool short_sweeps = false;
  integrators::StepControl control = integrators::StepControl::fixed;
  std::string label() const {
    return method.name + (short_sweeps ? " short" : "") +
           (control == integrators::StepControl::fixed ? ""
                                                       : std::string(" ") + to_string(control));
  }
};

/// Every trial of a comparison, and its reference.
struct Comparison {
  std::string title;
  double step_s = 0;                            ///< the trials began here
  double duration_s = 0, scene_duration_s = 0;  ///< simulated by each trial; stated by the scene
  bool by_energy =
      true;  ///< "error" is that of the energy; of the trajectory for a system with damping, whose
             ///< energy balance is not known to rounding
  Sensitivity sensitivity;
  double trajectory_time_s = 0;  ///< trajectories are compared here
  std::optional<ReferenceState> reference;
  std::vector<MethodTrials> methods;                         ///< in the order of the catalogue
  std::vector<std::pair<std::string, std::string>> skipped;  ///< method, why it does not fit
  std::vector<std::string> notes;
  double budget_s = 0, cpu_s = 0, wall_s = 0;
  bool interrupted = false;

  /// Whether the error says how accurate the method is. The energy error of an energy-exact method
  /// does not, unless its trials contradict that.
  bool speaks_of(const MethodTrials& m) const {
    return !by_energy || m.method.energy_exact != integrators::Claim::holds || contradicted(m);
  }
  /// Whether a method is declared to keep the energy, and a trial of it does not.
  static bool contradicted(const MethodTrials& m);
  /// The observed order of a method whose trials show less than it declares: the last two orders
  /// before rounding agree far better with each other than with the declared one.
  std::optional<double> order_below_declared(const MethodTrials& m) const;
  /// The error that is compared; NaN if a trial has none. One of the trajectory is never less than
  /// that of the reference.
  double error_of(const Trial& t) const;
};

/// @throws InvalidArgument for an unknown method, or a budget or duration that is not positive
void check(const CompareOptions& options);

/// Trials run one after another on the calling thread. Their numbers are the same every time; the
/// number of trials that fit into the budget is not.
/// @throws InvalidArgument as check() does
Comparison compare(const Scene& scene, const Assembly& assembly, const CompareOptions& options);

/// compare.json, compare.txt and work_precision.svg, as documented in docs/compare.md.
/// @throws IoError "cannot write <path>: ..."
void write_comparison(const std::string& folder, const Scene& scene, const Comparison& comparison);
/// Draws work_precision.svg in a folder of write_comparison() again. @return its path
/// @throws InvalidArgument for a folder without a compare.json, or with a damaged one
std::string replot_comparison(const std::filesystem::path& folder);
std::string comparison_json(const Scene& scene, const Comparison& comparison);
/// Which trials a table has: all, or of each method the one nearest to the target.
enum class TrialRows { all, nearest };
std::string comparison_table(const Scene& scene, const Comparison& comparison,
                             TrialRows which = TrialRows::all);

}  // namespace porthos::scene
