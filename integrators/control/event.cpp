#include "integrators/control/event.h"

#include <algorithm>
#include <cmath>

#include "integrators/control/zero-inl.h"

namespace porthos::integrators {
namespace {

bool wanted(Crossing c, bool rising) {
  return c == Crossing::both || (c == Crossing::rising) == rising;
}

/// On which side of an event g is; 0: on none, its neighbours decide.
int side(const Event& e, double g) { return e.beyond ? (g > *e.beyond ? 1 : -1) : sign_of(g); }

}  // namespace

EventStepper::EventStepper(const phs::Model& model,
                           const std::function<std::unique_ptr<Integrator>()>& make,
                           std::vector<Event> events, const EventOptions& options)
    : method_(make()),
      trial_(make()),
      events_(std::move(events)),
      options_(options),
      x_(size_t(model.description().nx)) {
  if (!options.to_grid) method_->sampler().refuse("a step that ends at an event");
  for (const auto& e : events_) {
    if (!e.g) throw InvalidArgument("an event has no function g(t, x)");
    if (e.beyond && (!(*e.beyond >= 0) || e.direction != Crossing::rising))
      throw InvalidArgument("an event has `beyond`, expected 0 or more and a rising event");
  }
  if (options.samples < 0 || options.most_trials < 1)
    throw InvalidArgument("an event search needs samples >= 0 and most_trials >= 1");
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) angles_.push_back(size_t(b.at));
}

EventResult EventStepper::step(phs::State& state) {
  return step(state, method_->step_size() * HUGE_VAL);
}

EventResult EventStepper::step(phs::State& state, double end) {
  const double forward = method_->step_size() > 0 ? 1 : -1;
  Outcome o = begin(state);
  h_ = method_->time(state) - t_;
  shortened_ = o == Outcome::ok && forward * (method_->time(state) - end) > 0;
  if (shortened_) {
    h_ = before_.until(end, method_->step_size());
    go_back(state);
    o = odd_step(state, h_);
  }
  if (o != Outcome::ok) return {.outcome = o};
  return finish(state);
}

EventResult EventStepper::run_to(phs::State& state, double end) {
  const double forward = method_->step_size() > 0 ? 1 : -1;
  for (bool more = forward * (end - method_->time(state)) > 0; more;) {
    const EventResult r = step(state, end);
    if (r.outcome != Outcome::ok || r.event >= 0) return r;
    // A step shortened to the end may miss it by rounding.
    more = !shortened_ && forward * (end - method_->time(state)) > 0;
  }
  return {};
}

bool EventStepper::between(const phs::State& s) const {
  return options_.to_grid && s.origin_step != 0 && s.origin_step == s.step;
}

void EventStepper::go_back(phs::State& state) {
  state = before_;
  method_->restore(memory_);
  method_->sampler().restore(held_);
}

/// Takes the step and stores what it started from.
Outcome EventStepper::begin(phs::State& state) {
  before_ = state;
  t_ = method_->time(state);
  memory_.clear();
  method_->save(memory_);
  held_.clear();
  method_->sampler().save(held_);
  if (!between(state)) return method_->step(state);
  // The rest of the step that an event interrupted, which is step number state.step.
  const double n = double(state.step), h = method_->step_size(), whole = n * h;
  const double left = ((whole - state.origin) - state.origin_lo) + std::fma(n, h, -whole);
  const Outcome o = method_->step_by(state, left);
  if (o != Outcome::ok) return o;
  state.step = before_.step;
  state.origin = state.origin_lo = 0;
  state.origin_step = 0;
  return o;
}

Outcome EventStepper::odd_step(phs::State& state, double h) {
  const Outcome o = method_->step_by(state, h);
  if (o == Outcome::ok && between(before_)) state.step = state.origin_step = before_.step;
  return o;
}

EventResult EventStepper::finish(phs::State& state) {
  trials_ = 0;
  tried_outcome_ = Outcome::ok;
  Root root;
  bool failed = false;
  for (size_t k = 0; k < events_.size() && !failed; ++k) failed = !search(int(k), state, root);
  left_event_ = -1;
  EventResult r{.outcome = tried_outcome_, .event = root.event, .rising = root.rising};
  if (failed) {
    go_back(state);
    r.event = -1;
    r.trials = trials_;
    return r;
  }
  if (root.event < 0) {
    r.trials = trials_;
    return r;
  }
  left_event_ = root.event;
  r.g = root.point.g;
  if (root.point.at < 1) {
    go_back(state);  // by the method itself: its ledger is then that of this step
    r.outcome = odd_step(state, root.point.at * h_);
  }
  r.trials = trials_;
  return r;
}

/// Unwraps the angles of x_: to the branch at the start of the step, or of the whole run.
void EventStepper::unwrap(const phs::State& s) {
  for (size_t i = 0; i < angles_.size(); ++i) {
    const std::int64_t here = options_.all_turns ? 0 : before_.turns[i];
    x_[angles_[i]] += phs::two_pi_hi * double(s.turns[i] - here);
  }
}

double EventStepper::g_of(const Event& e, double t, const phs::State& s) {
  std::copy(s.x.begin(), s.x.end(), x_.begin());
  unwrap(s);
  return e.g(t, x_);
}

double EventStepper::sampled(const Event& e, double at, const phs::State& after) {
  if (at <= 0) return g_of(e, t_, before_);
  if (at >= 1) return g_of(e, t_ + h_, after);
  if (!method_->interpolate(after, at, x_)) return NAN;
  unwrap(after);
  return e.g(t_ + at * h_, x_);
}

/// g after a step of length at·h from the last accepted state.
double EventStepper::tried(const Event& e, double at) {
  if (at <= 0) return g_of(e, t_, before_);
  tried_ = before_;
  ++trials_;
  trial_->restore(memory_);
  trial_->sampler().restore(held_);
  const Outcome o = trial_->step_by(tried_, at * h_);
  if (o != Outcome::ok) {
    tried_outcome_ = o;
    return NAN;
  }
  return g_of(e, trial_->time(tried_), tried_);
}

/// The first point up to `to` at which g is beyond an event, by steps that double, then halves.
EventStepper::Point EventStepper::leave(const Event& e, double from, Point to) {
  constexpr double closest = 0x1p-48;
  for (double d = closest; from + d < to.at && tried_outcome_ == Outcome::ok; d *= 2) {
    const Point p{from + d, tried(e, from + d)};
    if (side(e, p.g) > 0) {
      to = p;
      break;
    }
    from = p.at;
  }
  while (to.at - from > closest && tried_outcome_ == Outcome::ok) {
    const Point p{0.5 * (from + to.at), tried(e, 0.5 * (from + to.at))};
    if (side(e, p.g) > 0)
      to = p;
    else
      from = p.at;
  }
  return to;
}

/// The crossing between a and b, on either side of an event.
EventStepper::Point EventStepper::settle(const Event& e, Point a, Point b, double first) {
  if (e.beyond && a.g >= 0) return leave(e, a.at, b);
  const Point root =
      refine_zero(a, b, first, options_.most_trials, [&](double at) { return tried(e, at); });
  if (!e.beyond || tried_outcome_ != Outcome::ok) return root;
  // It passes 0, jumps over it, or has come to rest there, for longer than a millionth of the step.
  const Point soon{root.at + 0x1p-20, root.at + 0x1p-20 < b.at ? tried(e, root.at + 0x1p-20) : b.g};
  if (side(e, soon.g) < 0) return leave(e, soon.at, b);
  const bool jumps = root.g < -1e-6 * std::max(std::fabs(a.g), std::fabs(b.g));
  return jumps ? leave(e, root.at, soon.at < b.at ? soon : b) : root;
}

/// Searches for the first relevant crossing of an event; false if a re-step failed.
bool EventStepper::search(int event, const phs::State& after, Root& earliest) {
  const Event& e = events_[size_t(event)];
  const int n = options_.samples + 1;
  points_.clear();
  for (int i = event == left_event_ ? 1 : 0; i <= n; ++i) {
    const Point p{double(i) / n, sampled(e, double(i) / n, after)};
    if (std::isnan(p.g)) continue;  // no dense output here
    if (side(e, p.g) == 0 && i < n) continue;
    points_.push_back(p);
  }
  for (size_t i = 1; i < points_.size(); ++i) {
    Point a = points_[i - 1], b = points_[i];
    if (side(e, a.g) == side(e, b.g)) continue;
    const bool rising = side(e, a.g) < 0;
    if (!wanted(e.direction, rising)) continue;
    if (earliest.event >= 0 && a.at > earliest.point.at) return true;
    Point root = b;  // the end of the step if g is 0 there
    if (b.g != 0) {
      const double first = guess_zero(a, b, [&](double at) { return sampled(e, at, after); });
      // The dense output is less accurate than a step, so its signs are checked. If they are wrong,
      // the bracket is widened.
      size_t left = i - 1, right = i;
      const auto exact = [&](Point p) {
        return p.at == 0 || p.at == 1 ? p : Point{p.at, tried(e, p.at)};
      };
      const int before = rising ? -1 : 1;
      for (a = exact(a); side(e, a.g) != before && left > 0;) a = exact(points_[--left]);
      for (b = exact(b); side(e, b.g) == before && right + 1 < points_.size();)
        b = exact(points_[++right]);
      if (tried_outcome_ != Outcome::ok) return false;
      if (side(e, a.g) != before || side(e, b.g) == before) continue;  // it only touched 0
      root = settle(e, a, b, first);
      if (tried_outcome_ != Outcome::ok) return false;
    }
    if (earliest.event < 0 || root.at < earliest.point.at) earliest = {event, rising, root};
    return true;
  }
  return true;
}

}  // namespace porthos::integrators
