#include "scene/compare/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>

#include "scene/assemble/contacts.h"
#include "scene/assemble/parts.h"
#include "scene/run/cpu_clock.h"
#include "scene/run/ledger.h"
#include "space/split_integrator.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;

constexpr double short_s = 0.05;  // trials below this are repeated,
constexpr int most_repeats = 5;   // at most so often
constexpr int glance = 1000;      // steps between two looks at the limits

std::unique_ptr<integrators::Integrator> make(const Assembly& a, const Setting& s) {
  integrators::Options o;
  if (s.rtol > 0) {
    o.rtol = s.rtol;
    o.atol = 0.01 * s.rtol;
  }
  o.iteration_tolerance = s.iteration_tolerance;
  o.instants = s.instants;
  if (s.control != integrators::StepControl::fixed)
    return with_touches(*a.model, s.method, s.step, o, [&](const phs::Model& model) {
      return integrators::make_controlled(s.control, s.method, model, s.step,
                                          {.rate = s.control_rate, .length = s.control_length}, o);
    });
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
        ledger_(a.model->description()),
        whole_(s.control == integrators::StepControl::fixed) {
    const auto total = std::max<std::int64_t>(1, std::llround(o.duration / s.step));
    const auto every = std::max<std::int64_t>(1, total / o.records);
    end_ = whole_ ? double(total) * s.step : o.duration;
    record_every_ = double(every) * s.step;
    if (!whole_) record_every_ = std::min(record_every_, end_ / double(o.records));
    if (o.known) known_at_ = whole_ ? std::round(o.known->time / s.step) * s.step : o.known->time;
    state_ = a.initial;
    if (split_) split_->begin(state_);
  }

  /// Steps, stops the clock at the records and measures there.
  void run() {
    measure(true);
    std::int64_t records = 1;
    bool known = known_at_ > 0;
    while (!reached(end_) && trial_.complete()) {
      const double next = double(records) * record_every_;
      go_to(std::min({end_, next, known ? known_at_ : end_}));
      if (!trial_.complete()) break;
      if (reached(next) || reached(end_)) measure(reached(next));
      while (reached(double(records) * record_every_)) ++records;
      if (known && reached(known_at_)) {
        compare();
        known = false;
      }
      check_limits();
    }
    report();
  }

 private:
  double time() const { return integrator_->time(state_); }
  bool reached(double t) const { return t - time() < 1e-6 * integrator_->step_size(); }

  void go_to(double t) {
    const double start = thread_cpu_now();
    Outcome o = Outcome::ok;
    const auto steps = std::llround(t / integrator_->step_size());
    const double before = cpu_;
    for (int taken = 1; (whole_ ? state_.step < steps : !reached(t)) && o == Outcome::ok; ++taken) {
      o = integrator_->step(state_);
      if (o == Outcome::ok) ledger_.book(integrator_->port_work());
      if (taken % glance) continue;
      cpu_ = before + thread_cpu_now() - start;
      check_limits();
      if (!trial_.complete()) return;
    }
    cpu_ = before + thread_cpu_now() - start;
    if (o != Outcome::ok) fail(o);
  }
  void fail(Outcome o) {
    trial_.report.outcome = o;
    trial_.failure = integrators::to_string(o);
  }

  void measure(bool record) {
    const Measured& m = meter_.measure(time(), state_);
    if (!m.finite()) return fail(Outcome::not_finite);
    const double error = ledger_.add(time(), m, record);
    if (2 * time() <= end_) early_ = std::max(early_, std::fabs(error));
  }

  void compare() {
    const auto x = unwrapped(assembly_.model->description(), state_);
    trial_.trajectory_error = distance(*options_.scale, x, options_.known->x);
  }

  void check_limits() {
    if (reached(end_)) return;
    const bool stop = options_.stop && options_.stop->load(std::memory_order_relaxed);
    if (!stop && cpu_ <= options_.cpu_limit) return;
    trial_.broken_off = true;
    trial_.failure = stop ? "interrupted" : fmt::format("broken off after {:.2g} s of CPU", cpu_);
  }

  void report() {
    RunReport& r = trial_.report;
    r.step_s = integrator_->step_size();
    r.steps = state_.step;
    r.simulated_s = time();
    r.step_control = trial_.setting.control;
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
  bool whole_;  ///< all steps have one size
  double end_ = 0, record_every_ = 0, known_at_ = -1;
  double cpu_ = 0, early_ = 0;
};

}  // namespace

std::vector<double> switches_and(const Scene& scene, std::initializer_list<double> more) {
  std::vector<double> all = switches_of(scene);
  all.insert(all.end(), more);
  std::sort(all.begin(), all.end());
  return all;
}

std::optional<double> observed_order(const Trial& coarse, const Trial& fine) {
  const double h = coarse.setting.step / fine.setting.step;
  const double fell = coarse.trajectory_error.value_or(0) / fine.trajectory_error.value_or(0);
  if (!coarse.complete() || !fine.complete() || fine.setting.rtol > 0 || !(h > 1) || !(fell > 0) ||
      std::isinf(fell))
    return {};
  return std::log(fell) / std::log(h);
}

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
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    t.failure = e.what();
    t.refused = true;
    t.report.outcome = Outcome::failed;
  }
  t.spent_s = thread_cpu_now() - start;
  return t;
}

}  // namespace porthos::scene
