#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "integrators/control/step_control.h"
#include "integrators/core/integrator.h"
#include "scene/read/scene.h"
#include "scene/run/output_summary.h"
#include "scene/run/statistics.h"
#include "scene/run/wheel_momentum.h"
#include "space/ledgers.h"

namespace porthos::scene {

/// One line of the verdict: a quantity and its limit.
struct Check {
  std::string name;
  double value = 0, limit = 0;
  bool pass = false;
  /// false: the check holds with any step, by the method's structure or because it tests the model
  /// alone. So a pass says nothing about the motion.
  bool telling = true;
  bool latest = false;  ///< of several phases the last one counts, not the worst
};

/// A check without meaning for this run, and the reason.
struct NotApplicable {
  std::string name, why;
  /// The data do not decide it, as where a limit is exceeded by no more than they leave unknown:
  /// neither a pass nor a failure.
  bool undecided = false;
};

/// The verdict on the checks of a run, see docs/results.md.
enum class Verdict { pass, fail, not_judged };
const char* to_string(Verdict v);  ///< "pass", "fail", "not judged"

/// Errors of the energy over a run, measured in extended precision from value + low word.
struct EnergyReport {
  /// Where less moves than this part of the energy at the start, errors are relative to the latter.
  static constexpr double next_to_nothing = 0x1p-40;
  double initial_J = 0;
  /// Errors are relative to this: the largest kinetic energy plus the range of each other stored
  /// energy, which does not depend on the zero of a potential or the origin; or the energy turned
  /// over by sources and losses if that is more.
  double scale_J = 0;
  double max_abs_error_J = 0, max_rel_error = 0;  ///< at the records and between them
  double rms_rel_error = 0;                       ///< over records
  double growth_exponent =
      0;  ///< slope of log rms(H(t+τ) - H(t)) against log τ: ½ a random walk, 1 a drift
  double drift_per_s = 0;  ///< mean relative change per second
  bool drift_is_significant =
      false;                  ///< beyond what a random walk or an oscillation does: ErrorStatistics
  bool about_centre = false;  ///< all of it is of the motion about the centre of mass
  /// The parts of the scale: the largest kinetic energy, then the range of each other storage.
  std::vector<std::pair<std::string, double>> scale_parts = {};
  double swing_growth = 1;  ///< of the scatter of the error: ErrorStatistics
  /// A jump within one record that most of the error is (ErrorStatistics): when [s], its relative
  /// size; NaN: none.
  double jump_s = std::nan(""), jump = std::nan("");
  std::string jump_then = {};                 ///< "stays there"
  bool slows = false;                         ///< ErrorStatistics
  GrowthUnknown unknown = GrowthUnknown::no;  ///< why growth_exponent is NaN
  bool kinks = false;  ///< springs whose derivatives jump make more of it than passes
  /// By more than that of a bounded error is ever seen to rise from part to part.
  bool swings_grow() const { return swing_growth >= 2; }
};

/// A [[stop]] that ended a run.
struct Stopped {
  std::string name, condition;
  double at = 0;  ///< [s]
  bool fails = false;
};
Stopped stopped_by(const Stop& stop, double at);

struct RunReport;
/// Notes the stop in a report; its check is one of StopValues.
void note_stop(RunReport& report, const Stopped& by);
/// Impacts of a rigid contact or stop.
struct ImpactRow {
  static constexpr int most_times = 100;
  std::string name;
  std::int64_t count = 0;
  std::vector<double> first_s = {};  ///< times of the first most_times [s]
  friend bool operator==(const ImpactRow&, const ImpactRow&) = default;
};

/// The content of summary.json of a run.
struct RunReport {
  std::string title, method;
  integrators::StepControl step_control = integrators::StepControl::fixed;
  double step_s = 0, simulated_s = 0, cpu_s = 0, wall_s = 0;
  std::int64_t steps = 0, records = 0;
  std::int64_t looks = 0;  ///< steps measured between the records
  integrators::Cost cost;
  EnergyReport energy;
  double linear_momentum_error = 0, angular_momentum_error = 0,
         quaternion_norm_error = 0;                ///< relative, maxima
  int constraint_rows = 0;                         ///< 0: no constraints
  double constraint_gap = 0, constraint_slip = 0;  ///< largest |g| and |g'| [m | rad], [/s]
  double stored_J = 0, supplied_J = 0, dissipated_J = 0, defect_J = 0;  ///< balance over the run
  double turned_over_J = 0;  ///< Σ of the absolute works, step by step
  using Named = std::vector<std::pair<std::string, double>>;
  Named storages;       ///< change of each stored energy [J]
  Named ports, losses;  ///< energy supplied by each source, lost in each dissipating element [J]
  std::vector<ImpactRow> impacts;           ///< of rigid contacts and stops
  std::vector<ImpactRow> slips;             ///< of dry joints
  std::vector<MomentumRow> momentum;        ///< of wheels, the total last; empty without wheels
  Impulses impulses;                        ///< of thrusters and torquers; no rows without any
  std::vector<OutputRow> outputs;           ///< of the scene's [[output]]s
  std::optional<space::SpaceReport> space;  ///< of a spacecraft in orbit
  std::vector<Check> checks;
  std::vector<NotApplicable> not_applicable;
  std::vector<std::string> notes;
  integrators::Outcome outcome = integrators::Outcome::ok;
  std::string trouble;             ///< why the run ended, if more is known than its outcome
  int until = -1;                  ///< event of RunOptions::until that ended it, -1: none
  int phases = 0;                  ///< runs between events, see phases.h; 0: a scene without any
  std::optional<Stopped> stopped;  ///< the stop that ended it
  bool interrupted = false;
  phs::State final_state;  ///< the last good one; relative to Assembly::centre if there is one
  std::vector<double>
      held;  ///< memory of the sampled controllers there, in the order of Model::holds()
  bool own_slopes = false;  ///< energies may have slopes of the user's own: a model of theirs
  /// The places of two notes that each phase has and the whole makes anew; -1: none.
  std::int16_t delivered_note = -1, newton_note = -1;
  Named delivered;  ///< the most net energy each controller has given until any time [J]
  /// fail: the run did not reach its end, or a check does not hold. not_judged: none of the checks
  /// could have detected a wrong motion, or one is undecided.
  Verdict verdict() const;
  bool passed() const { return verdict() == Verdict::pass; }
};

/// Of a judged trajectory in place of its steps: "1081 rows, 0.05 s apart", "in the mean" where the
/// middle interval is another.
std::string rows_words(const RunReport& report);

/// summary.json of a report, as documented in docs/results.md. final_state: as RunReport's.
std::string summary_json(const Scene& scene, const Assembly& assembly, const RunReport& report,
                         const phs::State& final_state);

}  // namespace porthos::scene
