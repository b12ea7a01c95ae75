#include "scene/run/watched_run.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <utility>

#include "phs/network/network.h"

namespace porthos::scene {

using integrators::Outcome;

namespace {

const Scene& with_positive_numbers(const Scene& s) {
  for (const auto& [name, x] :
       {std::pair{"step", s.step}, {"duration", s.duration}, {"record_every", s.record_every}})
    if (!(x > 0) || !std::isfinite(x))
      throw InvalidArgument(
          fmt::format("{} is {}, expected a positive number of seconds", name, x));
  return s;
}

/// The caller's events and the scene's stops. A stop is passed during the run; at its start it is a
/// mistake.
std::vector<integrators::Event> with_stops(std::vector<integrators::Event> until,
                                           const Scene& scene, const Assembly& assembly) {
  auto stops = stop_events(scene, assembly);
  const phs::State& s = assembly.initial;
  if (const int k = stop_that_holds(stops, assembly, s.time(scene.step), s); k >= 0) {
    const Stop& stop = *ending_stops(scene)[size_t(k)];
    throw InvalidArgument(fmt::format(
        "{}: '{}'{} holds where the run starts, expected a run that begins before it", stop.where,
        stop.name, stop.name == text(stop) ? "" : fmt::format(" ({})", text(stop))));
  }
  std::move(stops.begin(), stops.end(), std::back_inserter(until));
  return until;
}

}  // namespace

WatchedRun::WatchedRun(const Scene& scene, const Assembly& assembly,
                       std::vector<integrators::Event> until, RecordSink record)
    : scene_(with_positive_numbers(scene)),
      assembly_(assembly),
      record_(std::move(record)),
      fixed_(scene.step_control == integrators::StepControl::fixed),
      stops_from_(int(until.size())),
      own_(make()),
      events_(make_events(with_stops(std::move(until), scene, assembly))),
      integrator_(events_ ? &events_->method() : own_.get()),
      monitor_(dynamic_cast<integrators::EnergyMonitor*>(integrator_)),
      split_(dynamic_cast<space::SplitIntegrator*>(monitor_ ? &monitor_->inner() : integrator_)),
      meter_(assembly),
      outputs_(scene, assembly),
      stop_values_(scene, assembly),
      end_rates_(assembly),
      view_(assembly),
      layout_(scene, assembly),
      row_(layout_.size()),
      ledgers_(layout_.ledgers, 0.0),
      window_(assembly.model->description(), layout_),
      state_(assembly.initial),
      before_(state_),
      steps_(steps_of(scene)),
      end_(steps_.time(steps_.total)),
      ledger_(assembly.model->description()),
      good_{state_, {}, {}, ledger_},
      seen_(assembly.model->description().powers.size(), 0) {
  if (layout_.reactions > 0) reactions_.emplace(*assembly.model);
}

/// The scene's method, with its monitor if there is one.
std::unique_ptr<integrators::Integrator> WatchedRun::make() const {
  auto method = make_integrator(scene_, *assembly_.model, scene_.step);
  if (!scene_.monitor) return method;
  integrators::MonitorOptions options = *scene_.monitor;
  if (assembly_.spacecraft) options.keeps = &assembly_.spacecraft->internal();
  return std::make_unique<integrators::EnergyMonitor>(std::move(method), *assembly_.model,
                                                      scene_.step, std::move(options));
}

/// The stepper that stops the run at the instant of an event, or at the end if steps vary; or that
/// returns from such an instant to whole steps.
std::unique_ptr<integrators::EventStepper> WatchedRun::make_events(
    std::vector<integrators::Event> until) {
  if (until.empty() && fixed_ && assembly_.initial.origin_step == 0) return nullptr;
  return std::make_unique<integrators::EventStepper>(
      *assembly_.model, [this] { return own_ ? std::move(own_) : make(); }, std::move(until),
      integrators::EventOptions{.samples = 1, .to_grid = fixed_, .all_turns = true});
}

void WatchedRun::save_memory(std::vector<double>& memory) const {
  memory.clear();
  integrator_->save(memory);
  integrator_->sampler().save(memory);
}

void WatchedRun::restore_memory(std::span<const double> m) {
  const size_t held = integrator_->sampler().memory().size();
  if (m.size() < held) require_size("memory of the integrator", m.size(), held);
  integrator_->restore(m.first(m.size() - held));
  integrator_->sampler().restore(m.last(held));
}

void WatchedRun::begin() {
  if (split_) split_->begin(state_);
  stop_values_.see(time(), state_, held());
  remember();
  record();
}

void WatchedRun::step() {
  const bool sees_rates =
      end_rates_.any() && (!fixed_ || steps_.at_record(state_.step + 1));  // if it ends at one
  const double from = time();
  if (!fixed_ || sees_rates) before_ = state_;
  outcome_ = fixed_ ? fixed_step() : controlled_step();
  if (outcome_ != Outcome::ok) return;
  ledger_.book(integrator_->port_work());
  note_impacts();
  if (stop_values_.any()) {
    acted_.clear();
    integrator_->sampler().save(acted_);
    stop_values_.see(time(), state_, acted_);
  }
  if (sees_rates && at_record()) end_rates_.see(before_, state_, time() - from);
  if (at_record() || ended())
    record();
  else
    look();
}

void WatchedRun::note_impacts() {
  for (const auto& jump : integrator_->jumps()) {
    if (++seen_[jump.power] > ImpactRow::most_times) continue;
    impacts_.push_back(double(jump.power));
    impacts_.push_back(jump.t);
  }
}
/// Takes over the impacts that save() stored.
void WatchedRun::restore_impacts(std::span<const double> impacts) {
  impacts_.assign(impacts.begin(), impacts.end());
  std::fill(seen_.begin(), seen_.end(), 0);
  for (size_t i = 0; i + 1 < impacts_.size(); i += 2)
    ++seen_[size_t(whole<std::int64_t>(impacts_[i], 0, double(seen_.size()) - 1))];
}

double WatchedRun::time() const {
  return fixed_ && !off_the_grid() ? steps_.time(state_.step) : integrator_->time(state_);
}

bool WatchedRun::ended() const {
  if (until_ >= 0) return true;
  return fixed_ ? state_.step >= steps_.total && time() >= end_ : time() >= scene_.duration;
}

/// Whether the last step reached a record time: exactly if the steps are fixed; otherwise the step
/// may end up to a step later.
bool WatchedRun::at_record() const {
  if (fixed_) return steps_.at_record(state_.step) && !off_the_grid();
  const auto count = [&](double t) { return std::floor(t / scene_.record_every); };
  return state_.step == 0 || count(time()) > count(integrator_->time(before_));
}

Outcome WatchedRun::fixed_step() {
  Outcome o;
  if (events_) {
    const auto r = events_->step(state_, steps_.last > 0 ? end_ : HUGE_VAL);
    o = r.outcome;
    until_ = r.event;
  } else {
    o = steps_.ends_short(state_.step) ? integrator_->step_by(state_, steps_.last)
                                       : integrator_->step(state_);
  }
  if (o == Outcome::ok && until_ < 0 && steps_.last > 0 && state_.step == steps_.total) {
    state_.origin = end_;  // not its rounding
    state_.origin_lo = 0;
  }
  return o;
}

/// A step chosen by the step control; a step that would pass an event or the end is repeated up to
/// it.
Outcome WatchedRun::controlled_step() {
  const auto r = events_->step(state_, scene_.duration);
  until_ = r.event;
  return r.outcome;
}

void WatchedRun::fill_ledgers() {
  if (!split_ || !split_->ledgers().started()) return;
  const auto now = split_->ledgers().now();
  std::copy(now.begin(), now.end(), ledgers_.begin());
}

std::vector<double> WatchedRun::held() const {
  const auto& holds = assembly_.model->holds();
  if (state_.step != 0 || holds.empty()) return integrator_->sampler().memory();
  const auto system = assembly_.model->instantiate<double>();
  integrators::TurnKeeper<double> turns(assembly_.model->description());
  turns.synchronise(state_, *system);
  std::vector<double> x(state_.x), all;
  for (size_t k = 0; k < x.size(); ++k) x[k] += state_.lo[k];
  for (size_t i = 0; i < holds.size(); ++i) {
    std::vector<double> memory = holds[i]->fresh;
    system->sample(i, time(), x, memory);
    all.insert(all.end(), memory.begin(), memory.end());
  }
  return all;
}

std::span<const double> WatchedRun::put_out() {
  if (outputs_.size() == 0) return {};
  return outputs_.at(time(), state_, held());
}

/// What the loops and couplings exert at the state.
std::span<const double> WatchedRun::react() {
  if (!reactions_) return {};
  reactions_->hold(integrator_->sampler().memory());
  reactions_->at(time(), state_.x, state_.turns);
  return reactions_->exerted();
}

/// The errors of a step between records, and the extrema.
void WatchedRun::look() {
  const bool all = scene_.extrema == Extrema::all;
  const Measured* m = &unmeasured_;
  double error = 0;
  if (all || state_.step % steps_to_a_look(integrator_->cost()) == 0) {
    m = &meter_.look(time(), state_);
    if (!m->finite()) return not_finite();
    error = ledger_.look(*m);
  }
  if (!record_ || !window_.watches()) return;
  fill_ledgers();
  fill_record(layout_, time(), view_(time(), state_), all ? *m : unmeasured_, ledger_.port_work(),
              error, 0, {}, ledgers_, all ? put_out() : std::span<const double>(), row_);
  window_.see(row_);
}

void WatchedRun::not_finite() {
  outcome_ = Outcome::not_finite;
  recall();
}

/// Measures and passes the record on. A state whose energy is not a number is a failure; the last
/// record is then the last good state.
void WatchedRun::record() {
  const Measured& m = meter_.measure(time(), state_);
  if (!m.finite() || !std::isfinite(meter_.initial_J())) return not_finite();
  const double error = ledger_.add(time(), m, at_record());
  if (record_) {
    fill_ledgers();
    fill_record(layout_, time(), view_(time(), state_), m, ledger_.port_work(), error,
                integrator_->cost().sweeps, react(), ledgers_, put_out(), row_);
    if (window_.watches()) {
      window_.see(row_);
      window_.put(row_);
      window_.restart();
    }
    record_(row_);
  }
  remember();
  // A law of the user's own that is not meant for this state, even where it gives numbers.
  if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&assembly_.internal());
      network && !network->hindrance(state_).empty())
    outcome_ = Outcome::failed;
}

void WatchedRun::remember() {
  good_.state = state_;
  save_memory(good_.memory);
  good_.cost = integrator_->cost();
  good_.ledger = ledger_;
  good_.impacts = impacts_.size();
  good_.stop_values = stop_values_.memory();
  good_.end_rates = end_rates_.memory();
}

void WatchedRun::recall() {
  state_ = good_.state;
  restore_memory(good_.memory);
  integrator_->set_cost(good_.cost);
  ledger_ = good_.ledger;
  impacts_.resize(good_.impacts);
  stop_values_.restore(good_.stop_values);
  end_rates_.restore(good_.end_rates);
  window_.restart();
}

void WatchedRun::save(Checkpoint& c) const {
  c.outcome = outcome_;
  c.state = state_;
  save_memory(c.memory);
  c.cost = integrator_->cost();
  c.statistics = ledger_.memory();
  const auto extrema = window_.memory();
  for (const auto* part :
       {&extrema, &stop_values_.memory(), &end_rates_.memory(), &std::as_const(impacts_)})
    c.statistics.insert(c.statistics.end(), part->begin(), part->end());
  c.statistics.push_back(double(impacts_.size()));
}

void WatchedRun::restore(const Checkpoint& c) {
  require_size("state of the checkpoint", c.state.x.size(), state_.x.size());
  require_size("low parts of the checkpoint", c.state.lo.size(), state_.lo.size());
  require_size("turns of the checkpoint", c.state.turns.size(), state_.turns.size());
  state_ = c.state;
  restore_memory(c.memory);
  integrator_->set_cost(c.cost);
  const size_t extrema = window_.memory().size(), stops = stop_values_.memory().size(),
               rates = end_rates_.memory().size();
  auto statistics = std::span<const double>(c.statistics);
  const double stored = statistics.empty() ? 0 : statistics.back();
  const size_t impacts = size_t(whole<std::int64_t>(stored, 0, double(statistics.size())));
  if (const size_t least = extrema + stops + rates + impacts + 1; statistics.size() < least)
    require_size("statistics of the checkpoint", statistics.size(), least);
  statistics = statistics.first(statistics.size() - 1);
  restore_impacts(statistics.last(impacts));
  statistics = statistics.first(statistics.size() - impacts);
  end_rates_.restore(statistics.last(rates));
  statistics = statistics.first(statistics.size() - rates);
  stop_values_.restore(statistics.last(stops));
  statistics = statistics.first(statistics.size() - stops);
  ledger_.restore(statistics.first(statistics.size() - extrema));
  window_.restore(statistics.last(extrema));
  remember();
}

double WatchedRun::fraction() const {
  return fixed_ ? double(state_.step) / double(steps_.total) : time() / scene_.duration;
}

}  // namespace porthos::scene
