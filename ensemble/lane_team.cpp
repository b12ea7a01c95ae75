#include "ensemble/lane_team.h"

#include <algorithm>

#include "phs/system/tunable.h"

namespace porthos::ensemble {

using integrators::Outcome;

namespace {

/// Whether see() is called after this number of steps.
bool is_seen(const BatchRun& r, std::int64_t taken) {
  const auto whole = [&](std::int64_t n) { return n > 0 && taken % n == 0; };
  return taken >= r.steps || whole(r.every) || whole(r.look);
}

/// The step at which the run is called next.
std::int64_t next_look(const BatchRun& r, std::int64_t step) {
  const std::int64_t taken = step - r.start.step;
  if (taken >= r.steps) return step;
  if (r.wants_port_work) return step + 1;
  std::int64_t next = r.steps;
  for (const std::int64_t n : {r.every, r.look})
    if (n > 0) next = std::min(next, (taken / n + 1) * n);
  return r.start.step + next;
}

/// Calls book() and see() of the run. @return whether it continues
bool hand_over(BatchRun& r, const phs::State& s, std::span<const double> works) {
  const std::int64_t taken = s.step - r.start.step;
  const bool last = taken >= r.steps;
  if (r.wants_port_work && taken > 0) r.book(works);
  if (taken > 0 && is_seen(r, taken) && !r.see(s)) return false;
  return !last;
}

}  // namespace

LaneTeam::LaneTeam(const phs::Model& model, std::string method, double step,
                   integrators::Options options, bool lanes)
    : model_(model),
      method_(std::move(method)),
      step_(step),
      options_(options),
      powers_(model.description().powers.size()),
      port_work_(powers_) {
  const auto one = model.instantiate<double>();
  for (const double p : phs::parameters_of(*one)) given_.push_back(p);
  if (lanes) lanes_ = integrators::make_lane_integrator(method_, model, step, options);
  if (!lanes_) return;
  run_.resize(size_t(lanes_->width));
  parameters_ = phs::parameters_of(lanes_->system());  // empty lanes are evaluated too
  for (size_t i = 0; i < parameters_.size(); ++i) parameters_[i] = Lanes(given_[i]);
}

void LaneTeam::check(const BatchRun& r) const {
  require_size("start state of a run", r.start.x.size(), size_t(model_.description().nx));
  if (!r.parameters.empty())
    require_size("parameters of a run", r.parameters.size(), given_.size());
}

void LaneTeam::work(const Source& next, const std::function<bool()>& stopped) {
  stopped_ = stopped;
  if (!lanes_) {
    while (auto run = next()) {
      run->prepare();
      alone(*run, run->start, {});
    }
    return;
  }
  for (int l = 0; l < lanes_->width; ++l)
    if (!fill(l, next)) break;
  while (const auto done = lanes_->run()) {
    if (stopped_()) break;
    for (int l = 0; l < lanes_->width; ++l) {
      if (!(done & (1u << l))) continue;
      arrived(l);
      if (!run_[size_t(l)] && !fill(l, next)) lanes_->clear(l);
    }
  }
  for (int l = 0; l < lanes_->width; ++l) {
    lanes_->clear(l);
    run_[size_t(l)].reset();
  }
}

bool LaneTeam::fill(int lane, const Source& next) {
  auto run = next();
  if (!run) return false;
  run->prepare();
  check(*run);
  const auto& p = run->parameters.empty() ? given_ : run->parameters;
  for (size_t i = 0; i < parameters_.size(); ++i) parameters_[i].set(lane, p[i]);
  lanes_->load(lane, run->start, next_look(*run, run->start.step));
  run_[size_t(lane)] = std::move(run);
  return true;
}

void LaneTeam::arrived(int lane) {
  auto& run = run_[size_t(lane)];
  lanes_->state(lane, state_);
  if (lanes_->stuck(lane)) {
    const auto memory = lanes_->memory(lane);
    alone(*run, state_, memory);
    run.reset();
    return;
  }
  if (run->wants_port_work) lanes_->port_work(lane, port_work_);
  if (hand_over(*run, state_, port_work_)) return lanes_->go_on(lane, next_look(*run, state_.step));
  run->end(state_, Outcome::ok);
  run.reset();
}

void LaneTeam::alone(BatchRun& r, phs::State s, std::span<const double> memory) {
  std::unique_ptr<phs::TunedModel> tuned;
  std::unique_ptr<integrators::Integrator> made;
  if (r.steps > 0) {
    check(r);
    if (!r.parameters.empty()) tuned = std::make_unique<phs::TunedModel>(model_, r.parameters);
    const phs::Model& model = tuned ? static_cast<const phs::Model&>(*tuned) : model_;
    made = integrators::make_integrator(method_, model, step_, options_);
    if (!memory.empty()) made->restore(memory);
  }
  Outcome o = Outcome::ok;
  bool more =
      memory.empty() ? hand_over(r, s, {}) : true;  // a stuck lane's state was already handed over
  while (more) {
    if (stopped_()) return;
    if ((o = made->step(s)) != Outcome::ok) break;
    more = hand_over(r, s, made->port_work());
  }
  if (made) {
    alone_.iterations += std::max(made->cost().sweeps, made->cost().steps);
    ++alone_.alone;
  }
  r.end(s, o);
}

}  // namespace porthos::ensemble
