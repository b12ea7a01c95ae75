#include "integrators/control/event_gradient.h"

#include <algorithm>
#include <cmath>

#include "integrators/control/event_steps-inl.h"

namespace porthos::integrators {
namespace {

/// Such a run backwards.
class AcrossEvents {
 public:
  AcrossEvents(const std::string& method, const std::vector<RunPhase>& phases, double h,
               const EventObjective& objective, const EventGradientOptions& options)
      : method_(method), phases_(phases), h_(h), objective_(objective), options_(options) {
    for (const RunPhase& phase : phases) {
      steps_.push_back(std::make_unique<PhaseSteps>(method, *phase.model, h));
      for (const auto& name : steps_.back()->parameters()) (void)place(name);
    }
    for (const RunPhase& phase : phases)
      for (const RunEvent& event : phase.events) {
        for (const auto& number : event.numbers) (void)place(event.name + "." + number.name);
        if (!event.guard) (void)place(event.name + ".at");
      }
  }

  EventGradient of(const phs::State& start, double duration) {
    EventLegs run(method_, phases_, h_, options_);
    r_.outcome = run.take(start, duration);
    r_.remark = run.remark();
    if (r_.outcome != Outcome::ok) return r_;
    const EventLeg& last = run.legs().back();
    r_.end = run.end();
    r_.time = run.time_at_end(last);
    const int event = last.event;
    const size_t to = event < 0 ? last.phase : next_phase(last);
    const auto x = phs::with_turns(phases_[to].model->description(), r_.end);
    lambda_ = TwoWords(x.size());
    add_cost(objective_.end, r_.time, x);
    by_time_ = event >= 0 && objective_.end_by_time ? objective_.end_by_time(r_.time, x) : 0;
    for (size_t i = run.legs().size(); i-- > 0;) {
      const EventLeg& leg = run.legs()[i];
      if (!back(run, leg, i > 0)) return r_;
    }
    std::ranges::reverse(r_.events);
    r_.start = lambda_.x;
    r_.parameters.resize(r_.names.size());
    for (size_t k = 0; k < r_.names.size(); ++k) r_.parameters[k] = sums_.x[k] + sums_.lo[k];
    return r_;
  }

 private:
  size_t place(const std::string& name) {
    const auto at = std::ranges::find(r_.names, name);
    if (at != r_.names.end()) return size_t(at - r_.names.begin());
    r_.names.push_back(name);
    sums_.x.push_back(0);
    sums_.lo.push_back(0);
    return r_.names.size() - 1;
  }
  size_t next_phase(const EventLeg& leg) const {
    const int then = phases_[leg.phase].events[size_t(leg.event)].then;
    return then < 0 ? leg.phase : size_t(then);
  }
  bool fail(Outcome o, const std::string& why) {
    r_.outcome = o;
    r_.remark = why;
    return false;
  }
  /// Adds a part of the cost, and its gradient to lambda_.
  void add_cost(const Objective::Part& part, double t, const std::vector<double>& x) {
    if (!part) return;
    std::vector<double> gradient(x.size(), 0.0);
    r_.cost += part(t, x, gradient);
    for (size_t k = 0; k < x.size(); ++k) lambda_.add(k, gradient[k]);
  }
  std::vector<double> lambda() const {
    std::vector<double> all = lambda_.x;
    for (size_t k = 0; k < all.size(); ++k) all[k] += lambda_.lo[k];
    return all;
  }

  /// From after the event that ends a leg to its start.
  bool back(const EventLegs& run, const EventLeg& leg, bool from_event) {
    PhaseSteps& steps = *steps_[leg.phase];
    const size_t count = leg.steps.size();
    if (const Outcome o = steps.to(leg.last, leg.steps.back().size); o != Outcome::ok)
      return fail(o, "a step before t = " + number(run.time_at_end(leg)) + " s");
    if (leg.event >= 0) {
      if (!back_over_event(run, leg)) return false;
    } else if (objective_.sampled) {
      add_cost(objective_.sampled, run.time_at_end(leg),
               phs::with_turns(steps.model().description(), leg.end));
    }
    by_time_ = 0;
    if (count == 1) return back_over_step(leg, from_event);
    if (!back_over_step(leg, false)) return false;
    if (count > 2 && !back_over_middle(leg)) return false;
    if (objective_.sampled)
      add_cost(objective_.sampled, leg.steps[0].origin,
               phs::with_turns(steps.model().description(), leg.second));
    if (const Outcome o = steps.to(leg.start, leg.steps[0].size); o != Outcome::ok)
      return fail(o, "the step after an event");
    return back_over_step(leg, from_event);
  }
  /// Over the step that steps_ is at. moves: its start is at an event, whose time moves.
  bool back_over_step(const EventLeg& leg, bool moves) {
    PhaseSteps& steps = *steps_[leg.phase];
    Outcome o = Outcome::ok;
    if (moves) {
      o = steps.by_times(-1, 1, change_);
      by_time_ = product_of(lambda(), change_);
    }
    TwoWords own(steps.parameters().size());
    if (o == Outcome::ok) o = steps.back(lambda_, own);
    add_parameters(steps.parameters(), own.x);
    return o == Outcome::ok || fail(o, "the adjoint of a step beside an event");
  }
  /// The steps between the first and the last; the end of the step before the last counts there.
  bool back_over_middle(const EventLeg& leg) {
    const auto target = lambda();
    const Objective J{.end =
                          [&](double, std::span<const double>, std::span<double> gradient) {
                            std::ranges::copy(target, gradient.begin());
                            return 0.0;
                          },
                      .sampled = objective_.sampled,
                      .running = {}};
    const auto count = leg.steps.size() - 2;
    const auto g =
        gradient_of_run(method_, *phases_[leg.phase].model, leg.second, h_, std::int64_t(count), J,
                        {.memory = options_.memory,
                         .taken = std::span<const TakenStep>(leg.steps).subspan(1, count),
                         .stop = options_.stop});
    if (g.outcome != Outcome::ok) return fail(g.outcome, g.remark);
    r_.cost += g.cost;
    lambda_ = TwoWords(std::span<const double>(g.start));
    add_parameters(g.names, g.parameters);
    return true;
  }
  void add_parameters(const std::vector<std::string>& names, std::span<const double> values) {
    for (size_t k = 0; k < names.size(); ++k) sums_.add(place(names[k]), values[k]);
  }

  /// From after an event to before it, where the last step of the leg ended.
  bool back_over_event(const EventLegs& run, const EventLeg& leg) {
    const RunEvent& event = phases_[leg.phase].events[size_t(leg.event)];
    const auto& d = phases_[leg.phase].model->description();
    const auto x = whole_numbers(d, leg.end), after = lambda();
    const double t = run.time_at_end(leg);
    const size_t n = x.size(), columns = n + 1 + event.numbers.size();
    EventInDuals in_duals(event);
    const auto reset = in_duals.reset_slopes(t, x, after.size());
    std::vector<double> by(columns, 0.0);  // (x, t, numbers)
    for (size_t i = 0; i < after.size(); ++i)
      for (size_t k = 0; k < columns; ++k)
        by[k] = std::fma(reset[i * columns + k], after[i], by[k]);
    by[n] += by_time_;
    if (const Outcome o = steps_[leg.phase]->by_times(1, 0, change_); o != Outcome::ok)
      return fail(o, "the tangent of the step before '" + event.name + "'");
    const double moved = product_of(by, change_) + by[n];
    double rate = NAN;
    if (event.guard) {
      const auto slopes = in_duals.guard_slopes(t, x);
      rate = product_of(slopes, change_) + slopes[n];
      if (const auto why = graze(event, leg, *steps_[leg.phase], t, rate, options_); !why.empty())
        return fail(Outcome::failed, why);
      for (size_t k = 0; k < columns; ++k) by[k] -= moved / rate * slopes[k];
    } else {
      sums_.add(place(event.name + ".at"), moved);
    }
    for (size_t k = 0; k < event.numbers.size(); ++k)
      sums_.add(place(event.name + "." + event.numbers[k].name), by[n + 1 + k]);
    lambda_ = TwoWords(std::span<const double>(by).first(n));
    r_.events.push_back({leg.phase, size_t(leg.event), t, rate});
    return true;
  }

  const std::string& method_;
  const std::vector<RunPhase>& phases_;
  double h_;
  const EventObjective& objective_;
  const EventGradientOptions& options_;
  std::vector<std::unique_ptr<PhaseSteps>> steps_;
  EventGradient r_;
  TwoWords lambda_{size_t(0)}, sums_{size_t(0)};
  double by_time_ = 0;  ///< ∂J by the time at which the leg behind begins, its start kept
  std::vector<double> change_;
};

}  // namespace

EventGradient gradient_across_events(const std::string& method, const std::vector<RunPhase>& phases,
                                     const phs::State& start, double h, double duration,
                                     const EventObjective& objective,
                                     const EventGradientOptions& options) {
  check_phases(phases, start, duration, h);
  return AcrossEvents(method, phases, h, objective, options).of(start, duration);
}

}  // namespace porthos::integrators
