#include "scene/sensitivity/event_run.h"

#include <fmt/format.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>

#include "mechanics/derivatives/linearised_mechanism.h"
#include "scene/read/toml_file-inl.h"
#include "scene/run/watched_run.h"
#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/end_quantities.h"

namespace porthos::scene {
namespace {

using integrators::RunEvent;
using mechanics::MovingMechanism;
using phs::Dual;
using Type = Event::Type;

/// Numbers with derivatives, as the matrix `by` gives them of the changes from `at`.
class LinearMap {
 public:
  LinearMap(std::vector<double> from, std::vector<double> to, Eigen::MatrixXd by)
      : from_(std::move(from)), to_(std::move(to)), by_(std::move(by)) {}

  /// @param numbers  of the event, without effect, then its parameters
  void operator()(RunEvent::In numbers, const Dual&, RunEvent::In x, std::span<Dual> after) const {
    const size_t n = from_.size(), parameters = size_t(by_.cols()) - n;
    const auto changes = numbers.last(parameters);
    for (size_t i = 0; i < to_.size(); ++i) {
      Dual sum(0.0);
      for (size_t k = 0; k < n; ++k) sum = sum + Dual(by_(long(i), long(k))) * (x[k] - from_[k]);
      for (size_t k = 0; k < parameters; ++k)
        sum = sum + Dual(by_(long(i), long(n + k))) * changes[k];
      after[i] = Dual(to_[i]) + sum;
    }
  }

 private:
  std::vector<double> from_, to_;
  Eigen::MatrixXd by_;
};

Event with_one_limit(const Event& e, double mechanics::Latch::*limit) {
  Event one = without_limits(e);
  one.latch.*limit = e.latch.*limit;
  return one;
}

bool frees(const Event& e) { return e.type == Type::release || e.type == Type::unlock; }

}  // namespace

struct EventRun::Slopes : Eigen::MatrixXd {
  using Eigen::MatrixXd::MatrixXd;
};
EventRun::~EventRun() = default;

EventRun::EventRun(const Scene& scene, const Assembly& assembly, const std::string& instead,
                   const std::atomic<bool>* stop)
    : scene_(scene), assembly_(assembly) {
  run(instead, stop);
  if (!failure_.empty()) return;
  if (!integrators::parameters_of_run(scene.method, *assembly.model, scene.step).empty())
    for (const Made& m : made_) {
      const auto linear = mechanics::linearise<double>(*m.assembly.mechanism);
      for (const auto& name : linear->parameters())
        if (std::ranges::find(inertias_, name) == inertias_.end()) inertias_.push_back(name);
    }
  for (size_t phase = 0; phase + 1 < made_.size(); ++phase) ends_.push_back(end_of(phase));
  const auto places = Eigen::Index(chain_->frozen().size());
  for (size_t i = 0; i < chain_->list().size(); ++i) {
    EventChain::Beside b{chain_->list()[i].before, chain_->list()[i].latching};
    frozen_.emplace_back(Eigen::MatrixXd::Zero(Eigen::Index(chain_->apply(i, b).size()), places));
  }
  variations_.resize(made_.size());
  for (size_t number = 0; number < chain_->frozen().size(); ++number)
    for (size_t point = 0; point < std::size(phs::difference_points); ++point)
      see_beside(number, point);
  for (size_t phase = 0; phase < made_.size(); ++phase) {
    models_.push_back(made_[phase].assembly.model);
    if (!variations_[phase].empty())
      models_.back() = std::make_shared<phs::VariedModel>(models_.back(), variations_[phase]);
    phases_.push_back({models_.back().get()});
    if (phase + 1 < made_.size()) phases_.back().events.push_back(event_after(phase));
  }
}

void EventRun::run(const std::string& instead, const std::atomic<bool>* stop) {
  const auto refuse = [&](const std::string& what) {
    throw InvalidArgument(in_file(scene_.path) + "a gradient across events takes " + what +
                          instead);
  };
  if (scene_.step_control != integrators::StepControl::fixed) refuse("steps of one size");
  for (const Event& e : scene_.events) {
    if (e.on_loop()) refuse("no [[event]] that closes or opens a loop");
    if (e.type == Type::engage) refuse("no [[event]] that engages a soft latch where it is");
  }
  (void)rehearse(scene_, assembly_);
  PhaseSequence phases(scene_, assembly_);
  if (!phases.happened().empty()) refuse("no [[event]] that happens at the start");
  chain_ = std::make_unique<EventChain>(scene_, assembly_, phases.moving());
  size_t known = 0;
  while (const Phase* p = phases.next()) {
    (void)differentiable_steps(p->scene, p->assembly, instead);
    if (p->assembly.model->description().nx != p->assembly.mechanical->description().nx)
      refuse("no parts with states of their own");
    Made made{p->scene, p->assembly, chain_->list().size()};
    WatchedRun watched(p->scene, p->assembly, p->until, {});
    const auto stopped = [&] { return stop && stop->load(std::memory_order_relaxed); };
    for (watched.begin(); watched.goes_on() && !stopped();) watched.step();
    const RunReport r = watched.report();
    if (stopped() || r.outcome != integrators::Outcome::ok) {
      failure_ = stopped() ? "the run was stopped"
                           : fmt::format("the run ended at t = {:.6g} s: {}", r.simulated_s,
                                         to_string(r.outcome));
      return;
    }
    if (r.until >= 0) made.met = p->waiting.at(size_t(r.until));
    phases.done(r);
    made.end = phases.now();
    const phs::State* state = &r.final_state;
    for (; known < phases.happened().size(); ++known, state = nullptr) {
      const Happened& h = phases.happened()[known];
      chain_->add(*h.event, h.at, made_.size(), state);
    }
    made_.push_back(std::move(made));
  }
  for (const Event& e : scene_.events)
    if (std::ranges::none_of(phases.happened(), [&](const auto& h) { return h.event == &e; }))
      notes_.push_back("it never happened, and the slopes are of runs without it: " + text(e));
}

/// The first event at the end of a phase, and the one behind the last.
std::pair<size_t, size_t> EventRun::events_after(size_t phase) const {
  return {made_[phase].before,
          phase + 1 < made_.size() ? made_[phase + 1].before : chain_->list().size()};
}

double EventRun::margin(const MovingMechanism& moving, const Event& e) const {
  return Latching::margin(scene_, moving, moving.state, HUGE_VAL, e);
}

/// Has the slopes of the margin where that is 0. A distance or speed r is the root of something
/// smooth, r² = (limit - margin)², whose differences are good however near the limit is to 0.
double EventRun::condition(const MovingMechanism& moving, const End& end) const {
  if (end.number == "after") return 0;
  const double m = margin(moving, end.event), r = end.value - m;
  return end.event.within_reach ? -r * r / (2 * end.value) : m;
}

EventRun::End EventRun::end_of(size_t phase) const {
  const Made& made = made_[phase];
  const size_t first = events_after(phase).first;
  MovingMechanism moving = chain_->list()[first].before;
  if (!made.met) return {chain_->list()[first].event, "at", made.end};
  const Event& e = *made.met;
  End end{e, e.above ? "above" : "below", e.above ? *e.above : e.below.value_or(0), false};
  if (made.end - e.after < margin(moving, e)) {
    end.number = "after";
    end.value = e.after;
  } else if (e.within_reach) {
    double least = HUGE_VAL;
    for (const auto& [key, limit] : {std::pair{"reach", &mechanics::Latch::reach},
                                     {"speed", &mechanics::Latch::speed},
                                     {"rate", &mechanics::Latch::rate}}) {
      const Event one = with_one_limit(e, limit);
      if (const double m = margin(moving, one); m < least) {
        least = m;
        end = {one, key, e.latch.*limit, false};
      }
    }
  }
  const auto moves = moves_of(moving.model->mechanism(), moving.state.x);
  for (size_t k = 0; k < moves.size(); ++k) {
    double& x = moving.state.x[k];
    const double own = x;
    end.by_state.push_back(difference_of(
        [&](double d) {
          x = own + d;
          return std::vector<double>{condition(moving, end)};
        },
        4 * moves[k] * phs::difference_distance)[0]);
    x = own;
  }
  end.by_parameters.assign(chain_->frozen().size(), 0.0);
  for (const double slope : by_inertias(moving, end.by_state)) end.by_parameters.push_back(-slope);
  return end;
}

/// A frozen number changed to a point of its difference: what that makes of the later events, of
/// the models, and of the conditions that phases end with.
void EventRun::see_beside(size_t number, size_t point) {
  const FrozenNumber& own = chain_->frozen()[number];
  const auto& [at, weight] = phs::difference_points[point];
  const double by = weight / phs::difference_distance;
  EventChain::Beside b = chain_->with_frozen(own, at * phs::difference_distance);
  const auto to_start_of = [&](size_t i) {
    b.moving.state = chain_->list()[i].before.state;
    b.moving.time = chain_->list()[i].before.time;
  };
  size_t next = own.happening + 1;
  for (size_t phase = chain_->list()[own.happening].phase; phase < made_.size(); ++phase) {
    for (; next < events_after(phase).second; ++next) {
      to_start_of(next);
      EventChain::Beside free = b;
      const Left left = chain_->apply(next, free);
      chain_->apply_as_on_run(next, b);  // what it freezes here is a number of its own
      for (size_t i = 0; i < left.size(); ++i)
        frozen_[next](Eigen::Index(i), Eigen::Index(number)) += by * left[i];
    }
    const size_t after = phase + 1;
    if (after >= made_.size() || !chain_->lasts(own, made_[after].before)) continue;
    auto made = chain_->phase_after(b, made_[after].end);
    if (point == 0) variations_[after].push_back({own.name, {}});
    variations_[after].back().beside.push_back(made.second.model);
    if (after + 1 == made_.size()) {
      beside_[own.name].push_back(std::move(made));
    } else if (!ends_[after].timed) {
      to_start_of(next);
      ends_[after].by_parameters[number] += by * condition(b.moving, ends_[after]);
    }
  }
}

/// λpᵀ ∂(M v)/∂θ by inertias_, at the rates of the mechanism.
std::vector<double> EventRun::by_inertias(const MovingMechanism& moving,
                                          std::span<const double> lambda) const {
  std::vector<double> all(inertias_.size(), 0.0);
  if (all.empty()) return all;
  const auto& m = moving.model->mechanism();
  const auto x = whole_state(moving);
  const auto v = moving.model->rates(std::span(moving.state.x), moving.state.turns);
  const auto found = mechanics::start_in_rates(m, std::span(x).first(size_t(m.nq())), v, lambda);
  const auto linear = mechanics::linearise<double>(m);
  for (size_t k = 0; k < found.parameters.size(); ++k)
    all[size_t(std::ranges::find(inertias_, linear->parameters()[k]) - inertias_.begin())] =
        found.parameters[k];
  return all;
}

/// What event i leaves, by (x before it, frozen numbers, inertias).
EventRun::Slopes EventRun::slopes_of(size_t i) const {
  const Happening& h = chain_->list()[i];
  const auto& x = h.before.state.x;
  const Eigen::Index rows = frozen_[i].rows(), n = Eigen::Index(x.size()),
                     places = frozen_[i].cols();
  Slopes by = Eigen::MatrixXd::Zero(rows, n + places + Eigen::Index(inertias_.size()));
  const auto moves = moves_of(h.before.model->mechanism(), x);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto slope = difference_of([&](double d) { return chain_->with_state(i, size_t(k), d); },
                                     4 * moves[size_t(k)] * phs::difference_distance);
    by.col(k) = Eigen::Map<const Eigen::VectorXd>(slope.data(), rows);
  }
  by.middleCols(n, places) = frozen_[i];
  if (inertias_.empty() || !frees(h.event)) return by;
  EventChain::Beside after{h.before, h.latching};
  (void)chain_->apply(i, after);
  const Eigen::Index nx = Eigen::Index(after.moving.state.x.size());
  for (Eigen::Index r = nx / 2; r < nx; ++r) {
    std::vector<double> own(size_t(nx), 0.0), old(x.size());
    own[size_t(r)] = 1;
    for (Eigen::Index k = 0; k < n; ++k) old[size_t(k)] = by(r, k);
    const auto gained = by_inertias(after.moving, own), lost = by_inertias(h.before, old);
    for (size_t k = 0; k < gained.size(); ++k)
      by(r, n + places + Eigen::Index(k)) = gained[k] - lost[k];
  }
  return by;
}

RunEvent EventRun::event_after(size_t phase) {
  const auto [first, behind] = events_after(phase);
  const auto& all = chain_->frozen();
  const auto& list = chain_->list();
  const Happening& h = list[first];
  const End& end = ends_[phase];
  const auto from = whole_state(h.before);
  const auto n = Eigen::Index(from.size()), places = Eigen::Index(all.size()),
             columns = n + places + Eigen::Index(inertias_.size());
  RunEvent e{.name = key_of(scene_, end.event), .at = end.value, .then = int(phase) + 1};
  if (!end.timed) add_guard(e, end, h.before);
  Eigen::MatrixXd x = Eigen::MatrixXd::Identity(n, columns),
                  frozen = Eigen::MatrixXd::Identity(columns, columns).middleRows(n, places), set;
  Left to;
  for (size_t i = first; i < behind; ++i) {
    EventChain::Beside b{list[i].before, list[i].latching};
    to = chain_->apply(i, b);
    const auto by = slopes_of(i);
    const auto nx = Eigen::Index(b.moving.state.x.size()), before = x.rows();
    Eigen::MatrixXd left = by.leftCols(before) * x + by.middleCols(before, places) * frozen;
    left.rightCols(columns - n - places) += by.rightCols(columns - n - places);
    x = left.topRows(nx);
    to.resize(size_t(nx));
    for (Eigen::Index k = 0; k < places; ++k)
      if (all[size_t(k)].happening == i) {
        frozen.row(k) = left.row(nx + all[size_t(k)].number);
        e.sets.push_back(all[size_t(k)].name);
        set.conservativeResize(set.rows() + 1, columns);
        set.bottomRows(1) = frozen.row(k);
      }
  }
  Eigen::MatrixXd whole(x.rows() + set.rows(), columns);
  whole.topRows(x.rows()) = x;
  if (set.rows() > 0) whole.bottomRows(set.rows()) = set;
  to.resize(size_t(whole.rows()), 0.0);
  for (const auto& place : all) e.parameters.push_back(place.name);
  e.parameters.insert(e.parameters.end(), inertias_.begin(), inertias_.end());
  e.reset = LinearMap(from, to, whole);
  const auto in_time = std::count_if(list.begin() + long(first), list.begin() + long(behind),
                                     [](const Happening& one) { return !one.event.waits(); });
  if (in_time <= 1) inputs_.push_back(input_of(end));  // of two, one alone would part them
  return e;
}

void EventRun::add_guard(RunEvent& e, const End& end, const MovingMechanism& there) const {
  e.numbers = {{end.number, end.value}};
  e.guard = [this, end, moving = there](RunEvent::In numbers, const Dual& t,
                                        RunEvent::In x) mutable {
    std::ranges::fill(moving.state.turns, 0);
    std::ranges::fill(moving.state.lo, 0.0);
    Dual sum(0.0);
    for (size_t k = 0; k < x.size(); ++k) {
      moving.state.x[k] = x[k].v;
      sum.d += end.by_state[k] * x[k].d;
    }
    sum.v = Latching::margin(scene_, moving, moving.state, t.v, end.event);
    if (end.number == "after") sum.d += t.d;
    sum.d += (end.number == "above" || end.number == "after" ? -1 : 1) * numbers[0].d;
    for (size_t k = 0; k < end.by_parameters.size(); ++k)
      sum.d += end.by_parameters[k] * numbers[k + 1].d;
    return sum;
  };
}

Input EventRun::input_of(const End& end) const {
  std::string unit = end.number == "reach" ? "m" : end.number == "speed" ? "m/s" : "rad/s";
  if (end.timed || end.number == "after") unit = "s";
  if (end.number == "above" || end.number == "below")
    unit = assembly_.mechanism->coordinate(end.event.name).unit;
  return {key_of(scene_, end.event) + "." + end.number, unit, end.value};
}

}  // namespace porthos::scene
