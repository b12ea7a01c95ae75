#pragma once
#include <algorithm>
#include <cmath>

#include "integrators/control/step_control.h"

namespace porthos::integrators {

/// Common part of both step controls: the last state, to recognise whether a state continues the
/// run, and the instants at which a step must end.
class Controlled : public Integrator {
 public:
  std::string remark() const override { return inner_->remark(); }
  std::span<const double> port_work() const override {
    return integrates_power() ? by_->port_work() : port_work_.of_step();
  }
  bool integrates_power() const override { return inner_->integrates_power(); }
  bool sees_inside() const override { return inner_->sees_inside(); }
  bool varies() const override { return true; }
  /// The size of the last step [s]: of `reversible` that which the method took.
  double taken() const { return taken_; }

  /// A step of the control's choice. If it would pass an instant, it is repeated up to that
  /// instant.
  Outcome step(State& s) final {
    if (sampler_.any()) sampler_.renew(*system_, turns_, s.time(h_), s);
    const double t = s.time(h_), next = next_instant(t);
    if (std::isinf(next)) return taken_back_unless_ok(chosen_step(s));
    before_ = s;
    memory_.clear();
    save(memory_);
    const Outcome o = chosen_step(s);
    // A remainder before the instant that is only rounding is no step.
    const double short_of = (next - s.time(h_)) / h_;
    if (o != Outcome::ok || short_of > 1e-9) return taken_back_unless_ok(o);
    s = before_;
    restore(memory_);
    --cost_.steps;
    return taken_back_unless_ok(step_to(next, s));
  }
  Cost cost() const override {
    Cost c = cost_;
    for (const Integrator* part : {inner_.get(), plain_.get()})
      if (part) {
        const Cost p = part->cost();
        c.evaluations += p.evaluations;
        c.sweeps += p.sweeps;
        c.factorisations += p.factorisations;
      }
    return c;
  }
  void set_cost(const Cost& c) override {
    cost_ = c;
    for (Integrator* part : {inner_.get(), plain_.get()})
      if (part) part->set_cost({});
  }

 protected:
  Controlled(Declaration d, const phs::Model& model, double h, const Options& o,
             const ControlOptions& control)
      : Integrator(std::move(d), model, h, o),
        scale_(control.scale ? control.scale : by_rates(model, h, control)) {
    sampler_.go_by_the_clock();
    last_.x.resize(n_);
    last_.lo.resize(n_);
    last_.turns.resize(size_t(model.description().angle_count()));
  }
  bool continues(const State& s) const { return have_last_ && s.x == last_.x && s.lo == last_.lo; }
  /// Stores the state after a step as the caller will return it: wrapped.
  void leave(const State& s) {
    last_ = s;
    have_last_ = true;
    if (options_.wrap) phs::wrap_angles(system_->description(), last_);
  }
  void carry_state(Archive& a) {
    a(have_last_);
    a(last_.x);
    a(last_.lo);
  }

  virtual Outcome chosen_step(State& s) = 0;

  std::shared_ptr<const phs::TimeScaleModel> scale_;
  std::unique_ptr<Integrator> inner_, plain_;
  const Integrator* by_ = nullptr;  ///< the one that took the last step
  bool port_work_aside() const { return port_work_.any() && !integrates_power(); }
  State last_;  ///< only x and lo are compared
  bool have_last_ = false;
  double taken_ = 0;

 private:
  static std::shared_ptr<const phs::TimeScaleModel> by_rates(const phs::Model& model, double h,
                                                             const ControlOptions& c) {
    return std::make_shared<phs::RateTimeScale>(model, c.rate == 0 ? 1 / std::fabs(h) : c.rate,
                                                c.length);
  }
  /// The first instant after t in the direction of the run; infinite if there is none.
  double next_instant(double t) const {
    const auto& instants = options_.instants;
    const double near = 1e-9 * std::fabs(h_);
    const double sampled = sampler_.next_instant(t, h_ < 0);
    if (h_ > 0) {
      const auto next = std::upper_bound(instants.begin(), instants.end(), t + near);
      return next == instants.end() ? sampled : std::fmin(*next, sampled);
    }
    const auto next = std::lower_bound(instants.begin(), instants.end(), t - near);
    return next == instants.begin() ? sampled : std::fmax(*(next - 1), sampled);
  }
  /// Takes the plain method up to an instant; the clock is then exact to the bit. The control
  /// restarts there, because the rates may jump.
  Outcome step_to(double instant, State& s) {
    const Outcome o = step_off_the_grid(s, s.until(instant, h_));
    if (o != Outcome::ok) return o;
    s.origin = instant;
    s.origin_lo = 0;
    have_last_ = false;
    return o;
  }

  std::vector<double> memory_;
  State before_;
};

}  // namespace porthos::integrators
