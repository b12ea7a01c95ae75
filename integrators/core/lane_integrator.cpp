#include "integrators/core/lane_integrator.h"

#include <bit>
#include <cmath>

namespace porthos::integrators {

LaneIntegrator::LaneIntegrator(const phs::Model& model, double h, const Options& o)
    : h_(h),
      options_(o),
      system_(model.instantiate<Lanes>()),
      n_(size_t(model.description().nx)),
      x_(n_, Lanes(0.0)),
      lo_(x_),
      ended_port_work_(model.description(), o.port_work),
      port_work_(ended_port_work_.of_step().size(), Lanes(0.0)) {
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) {
      auto alone = b;
      alone.at = int(angles_.size());
      angles_.push_back(size_t(b.at));
      angle_blocks_.blocks.push_back(alone);
    }
  turn_angles_.assign(angles_.size(), Lanes(0.0));
  run_.assign(size_t(width),
              {.clock = phs::State(angle_blocks_, std::vector<double>(angles_.size(), 0.0))});
}

LaneSet LaneIntegrator::in(Phase phase) const {
  Set s = 0;
  for (int l = 0; l < width; ++l)
    if (run_[size_t(l)].phase == phase) s |= lane_bit(l);
  return s;
}

void LaneIntegrator::put(int lane, const phs::State& state) {
  for (size_t k = 0; k < n_; ++k) {
    x_[k].set(lane, state.x[k]);
    lo_[k].set(lane, state.lo[k]);
  }
  forget(lane_bit(lane));
}

void LaneIntegrator::load(int lane, const phs::State& start, std::int64_t until) {
  require_size("start state", start.x.size(), n_);
  Run& r = run_[size_t(lane)];
  // Lanes without a run so far need a state at which the system can be evaluated.
  const bool first = in(Phase::idle) == lane_bit(width) - 1;
  for (int l = 0; l < width; ++l)
    if (first || l == lane) put(l, start);
  r.clock.turns = start.turns;
  r.clock.take_clock(start);
  tell_turns();
  r.phase = Phase::arrived;
  go_on(lane, until);
}

void LaneIntegrator::go_on(int lane, std::int64_t until) {
  Run& r = run_[size_t(lane)];
  r.until = until;
  if (r.clock.step < until) start(lane_bit(lane));
}

void LaneIntegrator::clear(int lane) { run_[size_t(lane)].phase = Phase::idle; }

LaneSet LaneIntegrator::run() {
  for (;;) {
    if (const Set done = in(Phase::arrived) | in(Phase::stuck)) return done;
    const Set working = in(Phase::working);
    if (!working) return 0;
    cost_.sweeps += std::popcount(working);
    ended(round(working));
  }
}

void LaneIntegrator::state(int lane, phs::State& to) const {
  to = run_[size_t(lane)].clock;
  to.x.resize(n_);
  to.lo.resize(n_);
  for (size_t k = 0; k < n_; ++k) {
    to.x[k] = x_[k][lane];
    to.lo[k] = lo_[k][lane];
  }
}

void LaneIntegrator::port_work(int lane, std::span<double> to) const {
  for (size_t a = 0; a < port_work_.size(); ++a) to[a] = port_work_[a][lane];
}

/// Counts finished steps, wraps angles, stops lanes or starts their next step.
void LaneIntegrator::ended(const Ended& e) {
  for_each_lane(e.failed(), [&](int l) { run_[size_t(l)].phase = Phase::stuck; });
  if (!e.done) return;
  const auto done = mask_of<Lanes>(e.done);
  for (size_t a = 0; a < port_work_.size(); ++a)
    port_work_[a] = select(done, ended_port_work_.of_step()[a], port_work_[a]);
  Set next = 0;
  for_each_lane(e.done, [&](int l) {
    Run& r = run_[size_t(l)];
    ++r.clock.step;
    if (options_.wrap) wrap(r, l);
    if (r.clock.step < r.until)
      next |= lane_bit(l);
    else
      r.phase = Phase::arrived;
  });
  if (next) start(next);
}

void LaneIntegrator::start(Set lanes) {
  for_each_lane(lanes, [&](int l) {
    t_.set(l, run_[size_t(l)].clock.time(h_));
    run_[size_t(l)].phase = Phase::working;
  });
  for_each_lane(begin(lanes), [&](int l) { run_[size_t(l)].phase = Phase::stuck; });
}

void LaneIntegrator::wrap(Run& run, int lane) {
  phs::State& s = run.clock;
  for (size_t a = 0; a < angles_.size(); ++a) {
    s.x[a] = x_[angles_[a]][lane];
    s.lo[a] = lo_[angles_[a]][lane];
  }
  if (!phs::wrap_angles(angle_blocks_, s)) return;
  for (size_t a = 0; a < angles_.size(); ++a) {
    x_[angles_[a]].set(lane, s.x[a]);
    lo_[angles_[a]].set(lane, s.lo[a]);
  }
  tell_turns();
}

void LaneIntegrator::tell_turns() {
  if (angles_.empty()) return;
  for (size_t a = 0; a < angles_.size(); ++a)
    for (int l = 0; l < width; ++l)
      turn_angles_[a].set(l, double(run_[size_t(l)].clock.turns[a]) * phs::two_pi_hi);
  system_->set_turn_angles(turn_angles_);
}

}  // namespace porthos::integrators
