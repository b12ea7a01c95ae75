#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "integrators/control/event.h"
#include "phs/system/reactions.h"
#include "scene/assemble/outputs.h"
#include "scene/assemble/steps.h"
#include "scene/run/checkpoint.h"
#include "scene/run/end_rates.h"
#include "scene/run/ledger.h"
#include "scene/run/run_report.h"
#include "scene/run/stop_values.h"
#include "space/split_integrator.h"

namespace porthos::scene {

/// Receives each record of a run: a row of WatchedRun::layout().
using RecordSink = std::function<void(std::span<const double>)>;

/// A run in progress, without files: integrator, meter, ledger, monitor and the clock of its steps.
/// `porthos run`, a phase between events, a case of an ensemble and a run in memory all use this
/// loop:
///
///     WatchedRun run(scene, assembly, until, sink);
///     for (run.begin(); run.goes_on();) run.step();
///
/// It gives the same bits for every caller. A step allocates nothing; a record allocates in
/// its sink, and for reactions that are not unique.
class WatchedRun {
 public:
  /// The scene must state its method and have no events, which are handled between runs. Its stops
  /// end the run like `until`. Scene and assembly must outlive the run.
  /// @param until   events that end the run, see RunOptions::until
  /// @param record  may be empty: then no rows are written
  /// @throws InvalidArgument if step, duration or record distance are not positive, if a stop holds
  /// at the start, and as make_integrator()
  WatchedRun(const Scene& scene, const Assembly& assembly, std::vector<integrators::Event> until,
             RecordSink record);
  WatchedRun(const WatchedRun&) = delete;

  /// Opens the ledger and takes the first record. Not for a run continued by restore().
  void begin();
  bool goes_on() const { return outcome_ == integrators::Outcome::ok && !ended(); }
  /// Takes a step, updates the ledger, and makes the record or intermediate measurement that is
  /// due. After a failure the state is the last good one.
  void step();

  /// Stores what the next steps depend on; the writer of the checkpoint fills the rest.
  void save(Checkpoint& checkpoint) const;
  /// Continues from where save() was called. @throws InvalidArgument if a size does not fit
  void restore(const Checkpoint& checkpoint);
  /// Whether a run of this method can be continued.
  bool resumable() const { return integrator_->declaration().resumable; }

  const RecordLayout& layout() const { return layout_; }
  integrators::Outcome outcome() const { return outcome_; }
  double fraction() const;  ///< completed part of the run
  std::int64_t steps() const { return state_.step; }
  bool has_steps() const { return steps_.total > 0; }

  /// Everything but the clocks, the notes, momenta and impulses (MomentumLedger) and the verdict.
  RunReport report() const;
  /// Adds notes for the reader: how numbers were used, joints beyond limits, the iteration.
  void add_notes(RunReport& report) const;
  /// Makes the checks that need no additional run, see verdict.h.
  void judge(RunReport& report) const;

 private:
  std::unique_ptr<integrators::Integrator> make() const;
  std::unique_ptr<integrators::EventStepper> make_events(std::vector<integrators::Event> until);
  void save_memory(std::vector<double>& memory) const;
  void restore_memory(std::span<const double> memory);
  bool off_the_grid() const { return state_.origin_step != 0; }
  double time() const;
  bool ended() const;
  bool at_record() const;
  integrators::Outcome fixed_step();
  integrators::Outcome controlled_step();
  void fill_ledgers();
  std::span<const double> react();
  void look();
  void record();
  /// What the sampled controllers hold; at time 0 what they sample then, as the first step does.
  std::vector<double> held() const;
  std::span<const double> put_out();
  void not_finite();
  void note_impacts();
  void restore_impacts(std::span<const double> impacts);
  void remember();
  void recall();

  const Scene& scene_;
  const Assembly& assembly_;
  const RecordSink record_;
  const bool fixed_;      ///< steps of the scene's size
  const int stops_from_;  ///< index of the first stop, behind the caller's events
  std::unique_ptr<integrators::Integrator> own_;       ///< null: events_ owns it
  std::unique_ptr<integrators::EventStepper> events_;  ///< null: all steps are whole ones
  integrators::Integrator* integrator_;
  integrators::EnergyMonitor* monitor_;  ///< null: none; else the integrator
  space::SplitIntegrator* split_;        ///< null: not in orbit
  Meter meter_;
  std::optional<phs::Reactions> reactions_;  ///< of loops and couplings
  Outputs outputs_;
  StopValues stop_values_;
  EndRates end_rates_;
  WorldView view_;  ///< records are in the world frame
  RecordLayout layout_;
  std::vector<double> row_, ledgers_;
  std::vector<double> acted_;  ///< what the sampled controllers held in the last step
  const Measured unmeasured_{};
  Window window_;
  phs::State state_, before_;  ///< before_: start of the last step, if it varies or rates are seen
  const Steps steps_;          ///< if they are fixed
  const double end_;           ///< [s]
  Ledger ledger_;
  struct Moment {
    phs::State state;
    std::vector<double> memory;
    integrators::Cost cost;
    Ledger ledger;
    size_t impacts = 0;
    std::vector<double> stop_values = {}, end_rates = {};
  } good_;  ///< the last record
  /// Power and time of the first impacts of every contact, and how many there were by power.
  std::vector<double> impacts_;
  std::vector<int> seen_;
  integrators::Outcome outcome_ = integrators::Outcome::ok;
  int until_ = -1;  ///< which event ended the run
};

}  // namespace porthos::scene
