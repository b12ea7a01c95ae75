#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "integrators/control/event_gradient.h"
#include "phs/scalars/derivative.h"

/// A run with events, as the legs between them. Private to event_*.cpp.
namespace porthos::integrators {

/// The phase that follows an event of this one.
inline size_t phase_after(const RunEvent& event, size_t phase) {
  return event.then < 0 ? phase : size_t(event.then);
}

/// An event in duals at an instant, with its derivatives by (x, t, its numbers and parameters).
class EventInDuals {
 public:
  explicit EventInDuals(const RunEvent& event) : event_(event) {}

  double guard(double t, std::span<const double> x) {
    seed(t, x);
    return guard().v;
  }
  std::vector<double> guard_slopes(double t, std::span<const double> x) {
    seed(t, x);
    std::vector<double> slopes(seeds_.size());
    phs::along_each(seeds_, [&](size_t k) { slopes[k] = guard().d; });
    return slopes;
  }
  /// The state after it and what it sets, n numbers.
  std::vector<double> reset(double t, std::span<const double> x, size_t n) {
    seed(t, x);
    std::vector<double> values;
    for (const auto& number : after(n)) values.push_back(number.v);
    return values;
  }
  /// Row by row, n rows.
  std::vector<double> reset_slopes(double t, std::span<const double> x, size_t n) {
    seed(t, x);
    std::vector<double> slopes(n * seeds_.size());
    phs::along_each(seeds_, [&](size_t k) {
      const auto& rows = after(n);
      for (size_t i = 0; i < n; ++i) slopes[i * seeds_.size() + k] = rows[i].d;
    });
    return slopes;
  }

 private:
  void seed(double t, std::span<const double> x) {
    n_ = x.size();
    seeds_.assign(x.begin(), x.end());
    seeds_.emplace_back(t);
    for (const auto& number : event_.numbers) seeds_.emplace_back(number.value);
    seeds_.resize(seeds_.size() + event_.parameters.size(), phs::Dual(0.0));
  }
  std::span<const phs::Dual> x() const { return std::span(seeds_).first(n_); }
  std::span<const phs::Dual> numbers() const { return std::span(seeds_).subspan(n_ + 1); }
  phs::Dual guard() const { return event_.guard(numbers(), seeds_[n_], x()); }
  const std::vector<phs::Dual>& after(size_t n) {
    after_.assign(x().begin(), x().end());
    after_.resize(n);
    if (event_.reset) event_.reset(numbers(), seeds_[n_], x(), after_);
    return after_;
  }

  const RunEvent& event_;
  size_t n_ = 0;
  std::vector<phs::Dual> seeds_, after_;
};

/// x + lo with all turns.
inline std::vector<double> whole_numbers(const phs::Description& d, const phs::State& s) {
  auto x = phs::with_turns(d, s);
  for (size_t k = 0; k < x.size(); ++k) x[k] += s.lo[k];
  return x;
}

/// A part of a run between two events.
struct EventLeg {
  size_t phase = 0;
  phs::State start, second, last, end;  ///< before its steps, after the first, before the last
  std::vector<TakenStep> steps = {};
  int event = -1;  ///< that ends it; -1: the end of the run
};

/// Takes such a run forwards.
class EventLegs {
 public:
  EventLegs(const std::string& method, const std::vector<RunPhase>& phases, double h,
            const EventGradientOptions& options)
      : method_(method), phases_(phases), h_(h), options_(options) {}

  Outcome take(const phs::State& start, double duration) {
    state_ = start;
    enter(0);
    while (!over_) {
      if (int(legs_.size()) > options_.most_events)
        return fail(Outcome::failed, "more than " + std::to_string(options_.most_events) +
                                         " events, expected fewer");
      const Outcome o = take_leg(duration);
      if (o != Outcome::ok) return o;
    }
    return Outcome::ok;
  }
  const std::vector<EventLeg>& legs() const { return legs_; }
  double time_at_end(const EventLeg& leg) const { return clock(leg.end).origin; }
  const phs::State& end() const { return state_; }
  const std::string& remark() const { return remark_; }

 private:
  const phs::Description& description() const { return phases_[phase_].model->description(); }
  Outcome fail(Outcome o, const std::string& why) {
    remark_ = why;
    return o;
  }
  /// The clock in two words.
  phs::State clock(const phs::State& s) const {
    phs::State c;
    c.take_clock(s);
    c.step_off_the_grid(h_, 0);
    return c;
  }
  void enter(size_t phase) {
    phase_ = phase;
    const phs::Model& model = *phases_[phase].model;
    std::vector<Event> events;
    located_.clear();
    for (size_t i = 0; i < phases_[phase].events.size(); ++i) {
      const RunEvent& own = phases_[phase].events[i];
      if (!own.guard) continue;
      located_.push_back(int(i));
      events.push_back({[in = EventInDuals(own)](double t, std::span<const double> x) mutable {
                          return in.guard(t, x);
                        },
                        own.direction});
    }
    stepper_ = std::make_unique<EventStepper>(
        model, [&] { return make_integrator(method_, model, h_, {.port_work = false}); },
        std::move(events), EventOptions{.to_grid = true, .all_turns = true});
  }
  /// The next event at a given time: its number, or -1.
  int next_at(double t) const {
    int next = -1;
    const auto& events = phases_[phase_].events;
    for (size_t i = 0; i < events.size(); ++i)
      if (!events[i].guard && events[i].at > t + near() &&
          (next < 0 || events[i].at < events[size_t(next)].at))
        next = int(i);
    return next;
  }
  double near() const { return 1e-9 * h_; }

  Outcome take_leg(double duration) {
    EventLeg leg{.phase = phase_, .start = state_, .second = {}, .last = {}, .end = {}};
    while (leg.event < 0) {
      if (options_.stop && options_.stop->load(std::memory_order_relaxed))
        return fail(Outcome::failed, "the run was stopped");
      const phs::State before = clock(state_);
      const double t = before.origin;
      const int timed = next_at(t);
      const double at = timed < 0 ? HUGE_VAL : phases_[phase_].events[size_t(timed)].at,
                   stop = std::min(at, duration);
      leg.last = state_;
      const bool whole_step = std::fabs(stop / h_ - std::round(stop / h_)) * h_ < near();
      const EventResult r = whole_step ? stepper_->step(state_) : stepper_->step(state_, stop);
      if (r.outcome != Outcome::ok)
        return fail(r.outcome, "the step at t = " + number(t) + " s: " + to_string(r.outcome));
      const phs::State after = clock(state_);
      double size = (after.origin - before.origin) + (after.origin_lo - before.origin_lo);
      if (std::fabs(size - h_) < 1e-15 * h_) size = h_;
      leg.steps.push_back({size, after.origin, after.origin_lo});
      if (leg.steps.size() == 1) leg.second = state_;
      if (r.event >= 0)
        leg.event = located_[size_t(r.event)];
      else if (timed >= 0 && after.origin > at - near())
        leg.event = timed;
      else if (after.origin > duration - near())
        break;
    }
    leg.end = state_;
    if (leg.event >= 0 && jumps_at_once(leg)) return Outcome::failed;
    over_ = leg.event < 0 || phases_[phase_].events[size_t(leg.event)].ends;
    if (!over_ && time_at_end(leg) > duration - near())
      return fail(Outcome::failed, "the event '" + phases_[phase_].events[size_t(leg.event)].name +
                                       "' is at the end of the run, expected another duration");
    legs_.push_back(std::move(leg));
    if (legs_.back().event >= 0) jump(legs_.back());
    return Outcome::ok;
  }
  /// Whether two events that are looked for happen at one instant.
  bool jumps_at_once(const EventLeg& leg) {
    const auto event = [&](const EventLeg& of) -> const RunEvent& {
      return phases_[of.phase].events[size_t(of.event)];
    };
    if (legs_.empty() || leg.steps.size() > 1 || leg.steps[0].size > 1e-12 * h_ ||
        !event(leg).guard || !event(legs_.back()).guard)
      return false;
    remark_ = "the events '" + event(legs_.back()).name + "' and '" + event(leg).name +
              "' are both at t = " + number(time_at_end(leg)) +
              " s: their order decides, so there is no derivative";
    return true;
  }
  void jump(const EventLeg& leg) {
    const RunEvent& event = phases_[phase_].events[size_t(leg.event)];
    const size_t to = phase_after(event, phase_);
    const auto& d = phases_[to].model->description();
    const auto x = whole_numbers(description(), state_);
    auto after = EventInDuals(event).reset(time_at_end(leg), x, size_t(d.nx) + event.sets.size());
    after.resize(size_t(d.nx));
    if (phases_[to].model == phases_[phase_].model) {
      for (size_t k = 0; k < after.size(); ++k) {
        if (after[k] == x[k]) continue;
        state_.x[k] += after[k] - x[k];
        state_.lo[k] = 0;
      }
    } else {
      phs::State next(d, after);
      next.take_clock(state_);
      state_ = std::move(next);
    }
    phs::wrap_angles(d, state_);
    if (to != phase_ && !over_) enter(to);
    phase_ = to;
  }

  const std::string& method_;
  const std::vector<RunPhase>& phases_;
  double h_;
  const EventGradientOptions& options_;
  std::unique_ptr<EventStepper> stepper_;
  std::vector<int> located_;  ///< the events of the stepper
  size_t phase_ = 0;
  phs::State state_;
  std::vector<EventLeg> legs_;
  bool over_ = false;
  std::string remark_;
};

}  // namespace porthos::integrators
