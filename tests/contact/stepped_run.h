#pragma once
#include "contact/time_stepping.h"
#include "tests/contact/rigid_run.h"

/// Runs by time stepping.
namespace porthos::test {

/// A run by "moreau".
struct Stepped {
  const ContactModel& model;
  std::unique_ptr<integrators::Integrator> method;
  phs::State state;
  Gauge gauge;
  std::vector<phs::PowerAccount> powers;
  double step_s;
  long double H0 = 0, lost = 0;
  double least_loss = HUGE_VAL;  ///< of a step, by all contacts
  Outcome outcome = Outcome::ok;

  Stepped(const ContactModel& m, const Numbers& x, double h, double tolerance = 0)
      : model(m),
        method(contact::with_time_stepping(m, m, h, {.iteration_tolerance = tolerance})),
        state(m.description(), x),
        gauge(m),
        powers(m.description().powers),
        step_s(h) {
    H0 = energy();
  }
  long double energy() { return gauge.energy(state); }
  bool step() {
    outcome = method->step(state);
    if (outcome != Outcome::ok) return false;
    double loss = 0;
    for (size_t a = 0; a < powers.size(); ++a)
      if (powers[a].kind == phs::PowerKind::dissipated) loss += method->port_work()[a];
    lost += loss;
    least_loss = std::min(least_loss, loss);
    return true;
  }
  /// To a time [s]. @return whether all steps were ok
  bool run(double until) {
    while (double(state.step) * step_s < until - 0.5 * step_s)
      if (!step()) return ADD_FAILURE() << to_string(outcome) << " " << method->remark(), false;
    return true;
  }
  double defect() { return double(energy() - H0 + lost); }
};

}  // namespace porthos::test
