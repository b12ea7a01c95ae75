#include <algorithm>
#include <set>

#include "integrators/control/event_gradient.h"
#include "integrators/control/event_steps-inl.h"

namespace porthos::integrators {
namespace {

/// A tangent on its way along a run with events.
class AlongEvents {
 public:
  AlongEvents(const std::string& method, const std::vector<RunPhase>& phases, double h,
              const std::map<std::string, double>& numbers, const EventGradientOptions& options)
      : method_(method), phases_(phases), h_(h), numbers_(numbers), options_(options) {
    for (const RunPhase& phase : phases)
      steps_.push_back(std::make_unique<PhaseSteps>(method, *phase.model, h));
  }

  EventTangent of(const phs::State& start, double duration, std::span<const double> direction) {
    EventLegs run(method_, phases_, h_, options_);
    r_.outcome = run.take(start, duration);
    r_.remark = run.remark();
    r_.end = run.end();
    if (r_.outcome != Outcome::ok) return r_;
    change_ = TwoWords(direction);
    for (const EventLeg& leg : run.legs())
      if (r_.outcome == Outcome::ok) r_.outcome = along(run, leg);
    r_.change = change_.x;
    r_.time_change = run.legs().back().event >= 0 ? moved_ : 0;
    return r_;
  }

 private:
  Outcome fail(Outcome o, const std::string& why) {
    r_.remark = why;
    return o;
  }
  Outcome along(const EventLegs& run, const EventLeg& leg) {
    PhaseSteps& steps = *steps_[leg.phase];
    phs::State state = leg.start;
    for (size_t i = 0; i < leg.steps.size(); ++i) {
      Outcome o = steps.to(state, leg.steps[i].size);
      if (o == Outcome::ok) o = steps.forwards(change_);
      if (o == Outcome::ok && i == 0 && moved_ != 0) {
        o = steps.by_times(-moved_, moved_, by_time_);
        add(by_time_, 1);
      }
      if (o != Outcome::ok)
        return fail(o, "a tangent of the step before t = " + number(leg.steps[i].origin) + " s");
      state = steps.state();
      state.origin = leg.steps[i].origin;
      state.origin_lo = leg.steps[i].origin_lo;
    }
    moved_ = 0;
    return leg.event < 0 ? Outcome::ok : over_event(run, leg);
  }
  Outcome over_event(const EventLegs& run, const EventLeg& leg) {
    PhaseSteps& steps = *steps_[leg.phase];
    const RunEvent& event = phases_[leg.phase].events[size_t(leg.event)];
    const auto x = whole_numbers(steps.model().description(), leg.end);
    const double t = run.time_at_end(leg);
    const size_t n = x.size(), columns = n + 1 + event.numbers.size() + event.parameters.size(),
                 to = phase_after(event, leg.phase),
                 after = size_t(phases_[to].model->description().nx);
    if (const Outcome o = steps.by_times(1, 0, by_time_); o != Outcome::ok)
      return fail(o, "the tangent of the step before '" + event.name + "'");
    std::vector<double> along(change_.x);  // (x, t, numbers)
    along.push_back(0);
    for (const auto& number : event.numbers) along.push_back(of(event.name + "." + number.name));
    along.resize(columns, 0.0);
    EventInDuals in_duals(event);
    moved_ = of(event.name + ".at");
    if (event.guard) {
      const auto slopes = in_duals.guard_slopes(t, x);
      const double rate = product_of(slopes, by_time_) + slopes[n];
      if (const auto why = graze(event, leg, steps, t, rate, options_); !why.empty())
        return fail(Outcome::failed, why);
      moved_ = -product_of(slopes, along) / rate;
    }
    for (size_t k = 0; k < n; ++k) along[k] = std::fma(by_time_[k], moved_, along[k]);
    along[n] = moved_;
    const auto reset = in_duals.reset_slopes(t, x, after);
    change_ = TwoWords(after);
    for (size_t i = 0; i < after; ++i)
      change_.x[i] = product_of(std::span(reset).subspan(i * columns, columns), along);
    return Outcome::ok;
  }
  void add(const std::vector<double>& v, double factor) {
    for (size_t k = 0; k < v.size(); ++k) change_.add(k, factor * v[k]);
  }
  double of(const std::string& name) const {
    const auto at = numbers_.find(name);
    return at == numbers_.end() ? 0 : at->second;
  }

  const std::string& method_;
  const std::vector<RunPhase>& phases_;
  double h_;
  const std::map<std::string, double>& numbers_;
  const EventGradientOptions& options_;
  std::vector<std::unique_ptr<PhaseSteps>> steps_;
  TwoWords change_{size_t(0)};
  double moved_ = 0;  ///< the time of the last event
  std::vector<double> by_time_;
  EventTangent r_;
};

void check_numbers(const std::vector<RunPhase>& phases,
                   const std::map<std::string, double>& numbers) {
  std::set<std::string> known;
  for (const RunPhase& phase : phases)
    for (const RunEvent& event : phase.events) {
      if (!event.sets.empty())
        throw InvalidArgument("the event '" + event.name + "' sets '" + event.sets.front() +
                              "', by which a tangent has no derivatives, expected a gradient");
      for (const auto& name : names_of(event)) known.insert(name);
    }
  for (const auto& entry : numbers)
    if (!known.contains(entry.first))
      throw InvalidArgument("no event has '" + entry.first + "', expected one of its numbers");
}

}  // namespace

EventTangent tangent_across_events(const std::string& method, const std::vector<RunPhase>& phases,
                                   const phs::State& start, double h, double duration,
                                   std::span<const double> direction,
                                   const std::map<std::string, double>& numbers,
                                   const EventGradientOptions& options) {
  check_phases(phases, start, duration, h);
  check_numbers(phases, numbers);
  require_size("direction", direction.size(), start.x.size());
  return AlongEvents(method, phases, h, numbers, options).of(start, duration, direction);
}

}  // namespace porthos::integrators
