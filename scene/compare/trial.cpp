#include "scene/compare/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "scene/run/cpu_clock.h"
#include "scene/run/ledger.h"
#include "space/split_integrator.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;

constexpr double short_s = 0.05;  // trials below this are repeated,
constexpr int most_repeats = 5;   // at most so often

std::unique_ptr<integrators::Integrator> make(const Assembly& a, const Setting& s) {
  integrators::Options o;
  if (s.rtol > 0) {
    o.rtol = s.rtol;
    o.atol = 0.01 * s.rtol;
  }
  o.iteration_tolerance = s.iteration_tolerance;
  return make_integrator(a, s.method, s.step, o);
}

class TrialRun {
 public:
  TrialRun(const Assembly& a, const Setting& s, const TrialOptions& o, Trial& t)
      : assembly_(a),
        options_(o),
        trial_(t),
        integrator_(make(a, s)),
        split_(dynamic_cast<space::SplitIntegrator*>(integrator_.get())),
        meter_(a),
        ledger_(a.model->description()) {
    total_ = std::max<std::int64_t>(1, std::llround(o.duration / s.step));
    every_ = std::max<std::int64_t>(1, total_ / o.records);
    known_at_ = o.known ? std::llround(o.known->time / s.step) : -1;
    state_ = a.initial;
    if (split_) split_->begin(state_);
  }

  /// Steps, stops the clock at the records and measures there.
  void run() {
    measure();
    while (state_.step < total_ && trial_.complete()) {
      const std::int64_t next = std::min({total_, (state_.step / every_ + 1) * every_, mark()});
      go_to(next);
      if (!trial_.complete()) break;
      if (state_.step % every_ == 0 || state_.step == total_) measure();
      if (state_.step == known_at_) compare();
      check_limits();
    }
    report();
  }

 private:
  std::int64_t mark() const { return known_at_ > state_.step ? known_at_ : total_; }

  void go_to(std::int64_t step) {
    const double start = thread_cpu_now();
    Outcome o = Outcome::ok;
    while (state_.step < step && o == Outcome::ok) {
      o = integrator_->step(state_);
      if (o == Outcome::ok) ledger_.book(integrator_->port_work());
    }
    cpu_ += thread_cpu_now() - start;
    if (o != Outcome::ok) fail(o);
  }
  void fail(Outcome o) {
    trial_.report.outcome = o;
    trial_.failure = integrators::to_string(o);
  }

  void measure() {
    const Measured& m = meter_.measure(state_);
    if (!m.finite()) return fail(Outcome::not_finite);
    const double t = double(state_.step) * integrator_->step_size();
    const double error = ledger_.add(t, m, state_.step % every_ == 0);
    if (2 * state_.step <= total_) early_ = std::max(early_, std::fabs(error));
  }

  void compare() {
    const auto x = unwrapped(assembly_.model->description(), state_);
    trial_.trajectory_error = distance(*options_.scale, x, options_.known->x);
  }

  void check_limits() {
    if (state_.step == total_) return;
    const bool stop = options_.stop && options_.stop->load(std::memory_order_relaxed);
    if (!stop && cpu_ <= options_.cpu_limit) return;
    trial_.broken_off = true;
    trial_.failure = stop ? "interrupted" : fmt::format("broken off after {:.2g} s of CPU", cpu_);
  }

  void report() {
    RunReport& r = trial_.report;
    r.step_s = integrator_->step_size();
    r.steps = state_.step;
    r.simulated_s = double(state_.step) * r.step_s;
    r.cost = integrator_->cost();
    r.cpu_s = cpu_;
    r.final_state = state_;
    ledger_.fill(r, meter_);
    if (split_) r.space = split_->ledgers().report();
    trial_.early_energy_error = early_ / r.energy.scale_J;
  }

  const Assembly& assembly_;
  const TrialOptions& options_;
  Trial& trial_;
  std::unique_ptr<integrators::Integrator> integrator_;
  space::SplitIntegrator* split_;  ///< null: not in orbit
  Meter meter_;
  Ledger ledger_;
  phs::State state_;
  std::int64_t total_ = 0, every_ = 1, known_at_ = -1;
  double cpu_ = 0, early_ = 0;
};

}  // namespace

double time_again(const Assembly& a, Trial& t) {
  const auto integrator = make(a, t.setting);
  phs::State state = a.initial;
  const double start = thread_cpu_now();
  while (state.step < t.report.steps && integrator->step(state) == Outcome::ok) {
  }
  const double cpu = thread_cpu_now() - start;
  t.report.cpu_s = std::min(t.report.cpu_s, cpu);
  ++t.timed;
  return cpu;
}

Trial run_trial(const Assembly& assembly, const Setting& setting, const TrialOptions& options) {
  const double start = thread_cpu_now();
  Trial t;
  t.setting = setting;
  t.report.method = setting.method;
  try {
    TrialRun(assembly, setting, options, t).run();
    while (options.repeat && t.complete() && t.report.cpu_s < short_s && t.timed < most_repeats)
      time_again(assembly, t);
  } catch (const std::exception& e) {
    t.failure = e.what();
    t.report.outcome = Outcome::failed;
  }
  t.spent_s = thread_cpu_now() - start;
  return t;
}

}  // namespace porthos::scene
