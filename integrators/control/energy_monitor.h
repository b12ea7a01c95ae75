#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "integrators/control/energy_projection.h"
#include "integrators/core/integrator.h"
#include "phs/system/energy_scale.h"

/// Monitors the energy balance during a run.
namespace porthos::integrators {

/// The reaction to a step that violates a limit. stop, and repeat if it does not help, return to
/// the last good state and end the run with Outcome::failed.
enum class OnViolation { warn, stop, repeat };
const char* to_string(OnViolation a);
/// @throws InvalidArgument for an unknown name, which lists the known ones
OnViolation on_violation_of(const std::string& name);

/// The limits of a monitor, and its reaction to a violation.
struct MonitorOptions {
  double limit = 0;       ///< of |defect| since the start, relative to the scale; 0: off
  double step_limit = 0;  ///< of the defect added by one step, relative; 0: off
  OnViolation action = OnViolation::warn;
  int most_halvings = 10;  ///< of a repeated step: up to 2^most_halvings parts
  /// 0: the largest kinetic energy plus the range of each other stored energy so far
  /// (phs/system/energy_scale.h), or the energy turnover if that is larger
  double scale_J = 0;
  /// Checks a state: returns the reason why it is not acceptable ("the elbow is beyond its stop"),
  /// or "". x: its value, angles wrapped.
  std::function<std::string(double t, std::span<const double> x)> watch = {};
  /// after each step, move the state to the energy that the ledger predicts, see EnergyProjection
  bool project = false;
  /// The model whose invariants a projection conserves; null: the monitored model. Its state is the
  /// first numbers of the model's state. It must outlive the monitor. Example: in orbit, the
  /// internal motion conserves angular momentum between the kicks, but the whole system does not.
  const phs::Model* keeps = nullptr;
};

/// The record of a monitor over a run.
struct MonitorReport {
  std::int64_t violations = 0, repeated = 0;  ///< steps; repeated: in parts, within the limit
  double first_s = 0;                         ///< time before the first violation
  double worst = 0;                           ///< largest relative defect that was accepted
  std::string last;                           ///< the last violation, as a sentence
  std::int64_t projected = 0,
               out_of_reach = 0;  ///< steps moved to their energy, and steps that could not be
  double moved_J = 0;             ///< Σ |energy| the projections moved
};

/// A monitored method. The defect is H - H(start) - supplied + dissipated, from the method's own
/// ledger, in double. Limits below 1e-14 would respond to its rounding. A defect below the rounding
/// of the stored energies is no violation. Cost: one evaluation of H per step (and a gradient for a
/// projection).
///
/// `repeat` repeats a step in 2, 4, 8 ... parts until the step limit holds. It does the same for a
/// step that does not converge or is not finite. (If steps vary and the size of that step is
/// unknown, it uses the longest.) With `project` the energy error stays at rounding whatever the
/// method does. The report therefore shows the defect before the projection, which measures the
/// method.
class EnergyMonitor : public Integrator {
 public:
  /// The model must outlive it. options: those of the inner method.
  /// @throws InvalidArgument for limits that are negative, below 1e-14 or not finite, for `repeat`
  ///   without a step limit, and for options without any effect
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
  std::span<const Jump> jumps() const override { return inner_->jumps(); }
  bool integrates_power() const override { return inner_->integrates_power(); }
  bool sees_inside() const override { return inner_->sees_inside(); }
  bool varies() const override { return inner_->varies(); }
  Cost cost() const override { return inner_->cost(); }
  void set_cost(const Cost& c) override { inner_->set_cost(c); }

  const MonitorReport& report() const { return report_; }
  Integrator& inner() { return *inner_; }
  /// The report in one sentence; empty if there is nothing to report.
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
  /// The fault of a step to this state, or nothing.
  std::string fault(const Account& after, const State& s);
  /// Stores what refuse() and again() return to.
  void keep(const State& s);
  void go_back(State& s);
  bool step_holds(const Account& after) const;
  /// A step of size h; on_grid: of the method's own size, counted by the clock.
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
  phs::EnergyScale scale_;             ///< over the accepted steps
  double scale_J_ = 1, rounding_ = 0;  ///< including the current step [J]
  State before_;
  std::vector<double> memory_before_;  ///< of the inner method
  std::vector<double> port_work_sum_, x_, stored_;
  std::vector<double> signs_;  ///< per power: +1 supplied, -1 dissipated
  bool whole_ = true;          ///< the last step was taken in one part and not projected
};

}  // namespace porthos::integrators
