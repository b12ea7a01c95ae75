#include "integrators/control/event_gradient.h"

#include <algorithm>
#include <cmath>

#include "integrators/control/event_steps-inl.h"

namespace porthos::integrators {
namespace {

/// A cost on its way back along a run with events.
struct CostAcross {
  explicit CostAcross(const EventObjective& J) : objective(J) {}

  /// Adds a part of the cost, and its gradient to lambda.
  void add(const Objective::Part& part, double t, const std::vector<double>& x) {
    if (!part) return;
    std::vector<double> gradient(x.size(), 0.0);
    r.cost += part(t, x, gradient);
    for (size_t k = 0; k < x.size(); ++k) lambda.add(k, gradient[k]);
  }
  /// lambda and its low words.
  std::vector<double> whole_lambda() const {
    std::vector<double> all = lambda.x;
    for (size_t k = 0; k < all.size(); ++k) all[k] += lambda.lo[k];
    return all;
  }
  /// Takes a sum away: it is what the event that set this parameter gets.
  double taken(size_t parameter) {
    const double sum = sums.x[parameter] + sums.lo[parameter];
    sums.x[parameter] = sums.lo[parameter] = 0;
    return sum;
  }

  const EventObjective& objective;
  TwoWords lambda{size_t(0)}, sums{size_t(0)};  ///< sums: of parameters, so far
  double by_time = 0;  ///< ∂J by the time at which the leg behind begins, its start kept
  EventGradient r;
};

/// Such a run backwards.
class AcrossEvents {
 public:
  AcrossEvents(const std::string& method, const std::vector<RunPhase>& phases, double h,
               std::span<const EventObjective> objectives, const EventGradientOptions& options)
      : method_(method),
        phases_(phases),
        h_(h),
        options_(options),
        costs_(objectives.begin(), objectives.end()) {
    for (const RunPhase& phase : phases) {
      steps_.push_back(std::make_unique<PhaseSteps>(method, *phase.model, h));
      for (const auto& name : steps_.back()->parameters()) (void)place(name);
    }
    for (const RunPhase& phase : phases)
      for (const RunEvent& event : phase.events) {
        for (const auto& name : names_of(event)) (void)place(name);
        for (const auto* list : {&event.parameters, &event.sets})
          for (const auto& name : *list) (void)place(name);
      }
  }

  std::vector<EventGradient> of(const phs::State& start, double duration) {
    EventLegs run(method_, phases_, h_, options_);
    outcome_ = run.take(start, duration);
    remark_ = run.remark();
    if (outcome_ == Outcome::ok) {
      begin(run);
      for (size_t i = run.legs().size(); i-- > 0;)
        if (!back(run, run.legs()[i], i > 0)) break;
    }
    std::ranges::reverse(events_);
    std::vector<EventGradient> all;
    for (CostAcross& c : costs_) {
      c.r.outcome = outcome_;
      c.r.remark = remark_;
      c.r.end = run.end();
      c.r.start = c.lambda.x;
      c.r.names = names_;
      for (size_t k = 0; k < c.sums.x.size(); ++k) c.r.parameters.push_back(c.taken(k));
      c.r.events = events_;
      all.push_back(std::move(c.r));
    }
    return all;
  }

 private:
  size_t place(const std::string& name) {
    const auto at = std::ranges::find(names_, name);
    if (at != names_.end()) return size_t(at - names_.begin());
    names_.push_back(name);
    for (CostAcross& c : costs_) {
      c.sums.x.push_back(0);
      c.sums.lo.push_back(0);
    }
    return names_.size() - 1;
  }
  bool fail(Outcome o, const std::string& why) {
    outcome_ = o;
    remark_ = why;
    return false;
  }
  /// At the end of the run.
  void begin(const EventLegs& run) {
    const EventLeg& last = run.legs().back();
    const size_t to = last.event < 0
                          ? last.phase
                          : phase_after(phases_[last.phase].events[size_t(last.event)], last.phase);
    const auto x = phs::with_turns(phases_[to].model->description(), run.end());
    for (CostAcross& c : costs_) {
      c.r.time = run.time_at_end(last);
      c.lambda = TwoWords(x.size());
      c.add(c.objective.end, c.r.time, x);
      if (last.event >= 0 && c.objective.end_by_time)
        c.by_time = c.objective.end_by_time(c.r.time, x);
      if (!c.objective.end_by_parameters) continue;
      for (const auto& [name, slope] : c.objective.end_by_parameters(c.r.time, x))
        c.sums.add(place(name), slope);
    }
  }

  /// From after the event that ends a leg to its start.
  bool back(const EventLegs& run, const EventLeg& leg, bool from_event) {
    PhaseSteps& steps = *steps_[leg.phase];
    const auto& d = steps.model().description();
    const size_t count = leg.steps.size();
    if (const Outcome o = steps.to(leg.last, leg.steps.back().size); o != Outcome::ok)
      return fail(o, "a step before t = " + number(run.time_at_end(leg)) + " s");
    if (leg.event >= 0) {
      if (!back_over_event(run, leg)) return false;
    } else {
      for (CostAcross& c : costs_)
        c.add(c.objective.sampled, run.time_at_end(leg), phs::with_turns(d, leg.end));
    }
    for (CostAcross& c : costs_) c.by_time = 0;
    if (count == 1) return back_over_step(leg, from_event);
    if (!back_over_step(leg, false)) return false;
    if (count > 2 && !back_over_middle(leg)) return false;
    for (CostAcross& c : costs_)
      c.add(c.objective.sampled, leg.steps[0].origin, phs::with_turns(d, leg.second));
    if (const Outcome o = steps.to(leg.start, leg.steps[0].size); o != Outcome::ok)
      return fail(o, "the step after an event");
    return back_over_step(leg, from_event);
  }
  /// Over the step that steps_ is at. moves: its start is at an event, whose time moves.
  bool back_over_step(const EventLeg& leg, bool moves) {
    PhaseSteps& steps = *steps_[leg.phase];
    Outcome o = moves ? steps.by_times(-1, 1, change_) : Outcome::ok;
    for (CostAcross& c : costs_) {
      if (o == Outcome::ok && moves) c.by_time = product_of(c.whole_lambda(), change_);
      TwoWords own(steps.parameters().size());
      if (o == Outcome::ok) o = steps.back(c.lambda, own);
      add_parameters(c, steps.parameters(), own.x);
    }
    return o == Outcome::ok || fail(o, "the adjoint of a step beside an event");
  }
  /// The steps between the first and the last; the end of the step before the last counts there.
  bool back_over_middle(const EventLeg& leg) {
    std::vector<Objective> objectives;
    for (const CostAcross& c : costs_)
      objectives.push_back({.end =
                                [target = c.whole_lambda()](double, std::span<const double>,
                                                            std::span<double> gradient) {
                                  std::ranges::copy(target, gradient.begin());
                                  return 0.0;
                                },
                            .sampled = c.objective.sampled,
                            .running = {}});
    const auto count = leg.steps.size() - 2;
    const auto all = gradients_of_run(
        method_, *phases_[leg.phase].model, leg.second, h_, std::int64_t(count), objectives,
        {.memory = options_.memory,
         .taken = std::span<const TakenStep>(leg.steps).subspan(1, count),
         .stop = options_.stop});
    for (size_t i = 0; i < all.size(); ++i) {
      if (all[i].outcome != Outcome::ok) return fail(all[i].outcome, all[i].remark);
      costs_[i].r.cost += all[i].cost;
      costs_[i].lambda = TwoWords(std::span<const double>(all[i].start));
      add_parameters(costs_[i], all[i].names, all[i].parameters);
    }
    return true;
  }
  void add_parameters(CostAcross& c, const std::vector<std::string>& names,
                      std::span<const double> values) {
    for (size_t k = 0; k < names.size(); ++k) c.sums.add(place(names[k]), values[k]);
  }

  /// From after an event to before it, where the last step of the leg ended.
  bool back_over_event(const EventLegs& run, const EventLeg& leg) {
    const RunEvent& event = phases_[leg.phase].events[size_t(leg.event)];
    const auto x = whole_numbers(phases_[leg.phase].model->description(), leg.end);
    const double t = run.time_at_end(leg);
    const size_t n = x.size(), after = costs_.front().lambda.x.size();
    EventInDuals in_duals(event);
    const auto reset = in_duals.reset_slopes(t, x, after + event.sets.size());
    if (const Outcome o = steps_[leg.phase]->by_times(1, 0, change_); o != Outcome::ok)
      return fail(o, "the tangent of the step before '" + event.name + "'");
    double rate = NAN;
    std::vector<double> slopes;
    if (event.guard) {
      slopes = in_duals.guard_slopes(t, x);
      rate = product_of(slopes, change_) + slopes[n];
      if (const auto why = graze(event, leg, *steps_[leg.phase], t, rate, options_); !why.empty())
        return fail(Outcome::failed, why);
    }
    for (CostAcross& c : costs_) back_over_event(c, event, reset, slopes, rate, n);
    events_.push_back({leg.phase, size_t(leg.event), t, rate});
    return true;
  }
  /// The same of one cost, with the slopes of reset and guard by (x, t, numbers, parameters).
  void back_over_event(CostAcross& c, const RunEvent& event, std::span<const double> reset,
                       std::span<const double> slopes, double rate, size_t n) {
    const size_t numbers = event.numbers.size(),
                 columns = n + 1 + numbers + event.parameters.size();
    auto after = c.whole_lambda();
    for (const auto& name : event.sets) after.push_back(c.taken(place(name)));
    std::vector<double> by(columns, 0.0);
    for (size_t i = 0; i < after.size(); ++i)
      for (size_t k = 0; k < columns; ++k)
        by[k] = std::fma(reset[i * columns + k], after[i], by[k]);
    by[n] += c.by_time;
    const double moved = product_of(by, change_) + by[n];
    if (event.guard)
      for (size_t k = 0; k < columns; ++k) by[k] -= moved / rate * slopes[k];
    const auto names = names_of(event);
    if (!event.guard) c.sums.add(place(names.back()), moved);
    for (size_t k = 0; k < numbers; ++k) c.sums.add(place(names[k]), by[n + 1 + k]);
    add_parameters(c, event.parameters, std::span(by).subspan(n + 1 + numbers));
    c.lambda = TwoWords(std::span<const double>(by).first(n));
  }

  const std::string& method_;
  const std::vector<RunPhase>& phases_;
  double h_;
  const EventGradientOptions& options_;
  std::vector<std::unique_ptr<PhaseSteps>> steps_;
  std::vector<std::string> names_;
  std::vector<CostAcross> costs_;
  std::vector<HappenedEvent> events_;
  std::vector<double> change_;
  Outcome outcome_ = Outcome::ok;
  std::string remark_;
};

}  // namespace

std::vector<EventGradient> gradients_across_events(const std::string& method,
                                                   const std::vector<RunPhase>& phases,
                                                   const phs::State& start, double h,
                                                   double duration,
                                                   std::span<const EventObjective> objectives,
                                                   const EventGradientOptions& options) {
  check_phases(phases, start, duration, h);
  if (objectives.empty()) throw InvalidArgument("there are no costs, expected one or more");
  return AcrossEvents(method, phases, h, objectives, options).of(start, duration);
}

EventGradient gradient_across_events(const std::string& method, const std::vector<RunPhase>& phases,
                                     const phs::State& start, double h, double duration,
                                     const EventObjective& objective,
                                     const EventGradientOptions& options) {
  return gradients_across_events(method, phases, start, h, duration, {&objective, 1}, options)
      .front();
}

}  // namespace porthos::integrators
