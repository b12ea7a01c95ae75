#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "integrators/control/event.h"
#include "scene/assemble/steps.h"
#include "scene/run/checkpoint.h"
#include "scene/run/ledger.h"
#include "scene/run/run_report.h"
#include "space/split_integrator.h"

namespace porthos::scene {

/// Takes each record of a run: a row of WatchedRun::layout().
using RecordSink = std::function<void(std::span<const double>)>;

/// A run at work, without files: integrator, meter, ledger, monitor and the clock of its steps.
/// What `porthos run` writes, what a phase between events is, a case of an ensemble and a run in
/// memory are all this loop:
///
///     WatchedRun run(scene, assembly, until, sink);
///     for (run.begin(); run.goes_on();) run.step();
///
/// The same bits whoever drives it. A step allocates nothing; a record allocates what its sink
/// does.
class WatchedRun {
 public:
  /// The scene states its method, and has no events: those are between runs. Scene and assembly
  /// must outlive it.
  /// @param until   end the run, see RunOptions::until
  /// @param record  may be empty: then no rows are made
  /// @throws InvalidArgument for step, duration or record distance that are no positive numbers,
  ///   and as make_integrator()
  WatchedRun(const Scene& scene, const Assembly& assembly, std::vector<integrators::Event> until,
             RecordSink record);
  WatchedRun(const WatchedRun&) = delete;

  /// Opens the ledger and takes the first record. Not for a run that restore() continues.
  void begin();
  bool goes_on() const { return outcome_ == integrators::Outcome::ok && !ended(); }
  /// A step with its ledger, and the record or the look it is due for. After a failure the state is
  /// the last good one.
  void step();

  /// Fills what the next steps depend on; the rest of a checkpoint belongs to who writes it.
  void save(Checkpoint& checkpoint) const;
  /// Continues where save() was called. @throws InvalidArgument if a size does not fit
  void restore(const Checkpoint& checkpoint);
  /// Whether a run of this method can be continued.
  bool resumable() const { return integrator_->declaration().resumable; }

  const RecordLayout& layout() const { return layout_; }
  integrators::Outcome outcome() const { return outcome_; }
  double fraction() const;  ///< of the run that is done
  std::int64_t steps() const { return state_.step; }
  bool has_steps() const { return steps_.total > 0; }

  /// Everything but the clocks, the notes, momenta and impulses (MomentumLedger) and the verdict.
  RunReport report() const;
  /// What a reader should know besides: how numbers were taken, joints beyond limits, the
  /// iteration.
  void add_notes(RunReport& report) const;
  /// The checks that need no run beside this one, see verdict.h.
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
  void look();
  void record();
  void not_finite();
  void remember();
  void recall();

  const Scene& scene_;
  const Assembly& assembly_;
  const RecordSink record_;
  const bool fixed_;                                   ///< steps of the scene's size
  std::unique_ptr<integrators::Integrator> own_;       ///< null: the one of events_
  std::unique_ptr<integrators::EventStepper> events_;  ///< null: all steps are whole ones
  integrators::Integrator* integrator_;
  integrators::EnergyMonitor* monitor_;  ///< null: none; else the integrator
  space::SplitIntegrator* split_;        ///< null: not in orbit
  Meter meter_;
  WorldView view_;  ///< records show the world
  RecordLayout layout_;
  std::vector<double> row_, ledgers_;
  const Measured unmeasured_{};
  Window window_;
  phs::State state_, before_;  ///< before_: of the step just taken, where steps vary
  const Steps steps_;          ///< where they are fixed
  const double end_;           ///< [s]
  Ledger ledger_;
  struct Moment {
    phs::State state;
    std::vector<double> memory;
    integrators::Cost cost;
    Ledger ledger;
  } good_;  ///< the last record
  integrators::Outcome outcome_ = integrators::Outcome::ok;
  int until_ = -1;  ///< which event ended the run
};

}  // namespace porthos::scene
