#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "integrators/control/energy_projection.h"
#include "integrators/core/integrator.h"
#include "phs/system/energy_scale.h"

/// Watches the balance of a run while it runs.
namespace porthos::integrators {

/// What happens where a step is not what it should be. stop and a repetition that does not help go
/// back to the last good state and end the run with Outcome::failed.
enum class OnViolation { warn, stop, repeat };
const char* to_string(OnViolation a);
/// @throws InvalidArgument for an unknown name, which lists the known ones
OnViolation on_violation_of(const std::string& name);

/// The limits of a monitor, and what it does beyond them.
struct MonitorOptions {
  double limit = 0;       ///< of |defect| since the start, relative to the scale; 0: not watched
  double step_limit = 0;  ///< of what one step adds to the defect, relative; 0: not watched
  OnViolation action = OnViolation::warn;
  int most_halvings = 10;  ///< of a step that is repeated: up to 2^most_halvings parts
  /// 0: the largest kinetic energy plus the range of each other stored energy so far
  /// (phs/system/energy_scale.h), or the energy turned over where that is more
  double scale_J = 0;
  /// Whether a state is one to go on from, else why not ("the elbow is beyond its stop"). x: its
  /// value, angles wrapped.
  std::function<std::string(double t, std::span<const double> x)> watch = {};
  /// after each step, move the state to the energy the ledger predicts, see EnergyProjection
  bool project = false;
  /// Whose invariants a projection keeps, null: the model's own. Its state is the first numbers of
  /// the model's; it must outlive the monitor. In orbit the internal motion keeps angular momentum
  /// between the kicks, the whole does not.
  const phs::Model* keeps = nullptr;
};

/// What a monitor saw over a run.
struct MonitorReport {
  std::int64_t violations = 0, repeated = 0;  ///< steps; repeated: in parts, to the limit
  double first_s = 0;                         ///< time before the first violation
  double worst = 0;                           ///< largest relative defect that was let pass
  std::string last;                           ///< what the last violation was, a sentence
  std::int64_t projected = 0,
               out_of_reach = 0;  ///< steps moved to their energy, and steps that could not be
  double moved_J = 0;             ///< Σ |energy| the projections moved
};

/// A method under watch. The defect is H - H(start) - supplied + dissipated, by the method's own
/// ledger, in double: limits below 1e-14 would watch its rounding, and what is below the rounding
/// of the stored energies is no violation. Cost: one evaluation of H a step (and a gradient to
/// project).
///
/// `repeat` takes a step again in 2, 4, 8 ... parts until the limit of a step holds; a step that
/// does not converge or is not finite likewise (of a step whose size varies and is not known, the
/// longest). With `project` the energy error stays at rounding whatever the method does, so the
/// defect shown before it is the measure of the method: it is in the report.
class EnergyMonitor : public Integrator {
 public:
  /// The model must outlive it. options: those the inner method was made with.
  /// @throws InvalidArgument for limits that are negative, below 1e-14 or not finite; for `repeat`
  ///   without a step limit; for nothing to do at all
  EnergyMonitor(std::unique_ptr<Integrator> inner, const phs::Model& model, double h,
                MonitorOptions monitor, const Options& options = {});

  Outcome step(State& state) override;
  Outcome step_by(State& state, double h) override;
  Outcome advance(double t, double h, State& state) override {
    return inner_->advance(t, h, state);
  }
  double time(const State& state) const override { return inner_->time(state); }
  void tell_turns(const State& state) override {
    Integrator::tell_turns(state);
    inner_->tell_turns(state);
  }
  bool interpolate(const State& after, double theta, std::span<double> x) const override {
    return whole_ && inner_->interpolate(after, theta, x);
  }
  void carry(Archive& archive) override;
  std::string remark() const override { return inner_->remark(); }
  std::span<const double> port_work() const override { return port_work_sum_; }
  bool integrates_power() const override { return inner_->integrates_power(); }
  bool sees_inside() const override { return inner_->sees_inside(); }
  bool varies() const override { return inner_->varies(); }
  Cost cost() const override { return inner_->cost(); }
  void set_cost(const Cost& c) override { inner_->set_cost(c); }

  const MonitorReport& report() const { return report_; }
  Integrator& inner() { return *inner_; }
  /// The report in a sentence; empty if there is nothing to say.
  std::string text() const;

 private:
  struct Account {  ///< numbers only: they are part of memory()
    double began = 0, H0 = 0, turned_over = 0;
    double income = 0, income_lo = 0;  ///< Σ supplied - dissipated
    double defect = 0;                 ///< before the last projection
  };
  void begin(const State& s);
  double energy(const State& s);
  bool beyond(double defect, double limit) const;
  Account booked(const State& s);
  /// What is wrong with a step to this state, or nothing.
  std::string fault(const Account& after, const State& s);
  /// Keeps what refuse() and again() go back to.
  void keep(const State& s);
  void go_back(State& s);
  bool step_holds(const Account& after) const;
  /// A step of size h; on_grid: of the method's own size, which the clock counts.
  Outcome take(State& s, double h, bool on_grid);
  double size_of_step_to(const State& s) const;
  Outcome again(State& s, double h, bool on_grid);
  Outcome accept(State& s, const Account& after, bool whole);
  Outcome refuse(State& s, Outcome o, const std::string& why);
  void note(const std::string& why, double defect);

  std::unique_ptr<Integrator> inner_;
  MonitorOptions monitor_;
  MonitorReport report_;
  std::unique_ptr<EnergyProjection> project_;
  Account account_;
  phs::EnergyScale scale_;             ///< of the steps let pass
  double scale_J_ = 1, rounding_ = 0;  ///< with the step in question [J]
  State before_;
  std::vector<double> memory_before_;  ///< of the inner method
  std::vector<double> port_work_sum_, x_, stored_;
  std::vector<double> signs_;  ///< per power: +1 supplied, -1 dissipated
  bool whole_ = true;          ///< the last step was taken in one part and left as it was
};

}  // namespace porthos::integrators
