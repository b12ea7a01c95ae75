#include "integrators/lane_integrator.h"

#include <cmath>

#include "integrators/catalogue.h"

namespace porthos::integrators {

LaneIntegrator::LaneIntegrator(const phs::Model& model, double h, const Options& o)
    : h_(h),
      options_(o),
      system_(model.instantiate<Lanes>()),
      n_(size_t(model.description().nx)),
      x_(n_, Lanes(0.0)),
      lo_(n_, Lanes(0.0)),
      works_(o.books ? model.description().powers.size() : 0, Lanes(0.0)),
      run_(size_t(width)) {
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) {
      auto alone = b;
      alone.at = int(angles_.size());
      angles_.push_back(size_t(b.at)), angle_blocks_.blocks.push_back(alone);
    }
  angle_state_ = phs::State(angle_blocks_, std::vector<double>(angles_.size(), 0.0));
  turn_angles_.assign(angles_.size(), Lanes(0.0));
  for (Run& r : run_) r.turns.assign(angles_.size(), 0);
}

phs::Mask<LaneIntegrator::width> LaneIntegrator::mask(Set lanes) {
  Lanes in(0.0);
  for (int l = 0; l < width; ++l)
    if (lanes & bit(l)) in.set(l, 1.0);
  return in > Lanes(0.0);
}

LaneIntegrator::Set LaneIntegrator::in(Phase phase) const {
  Set s = 0;
  for (int l = 0; l < width; ++l)
    if (run_[size_t(l)].phase == phase) s |= bit(l);
  return s;
}

void LaneIntegrator::load(int lane, const phs::State& start, std::int64_t until) {
  require_size("start state", start.x.size(), n_);
  Run& r = run_[size_t(lane)];
  // Lanes that have had no run yet must stand somewhere where the system can be evaluated.
  bool first = true;
  for (const Run& other : run_) first &= other.phase == Phase::idle;
  const auto put = [&](int l) {
    for (size_t k = 0; k < n_; ++k) x_[k].set(l, start.x[k]), lo_[k].set(l, start.lo[k]);
    forget(l);
  };
  if (first)
    for (int l = 0; l < width; ++l) put(l);
  else
    put(lane);
  r.step = start.step, r.origin = start.origin, r.origin_lo = start.origin_lo;
  r.origin_step = start.origin_step, r.turns = start.turns;
  tell_turns();
  r.phase = Phase::arrived;
  go_on(lane, until);
}

void LaneIntegrator::go_on(int lane, std::int64_t until) {
  Run& r = run_[size_t(lane)];
  r.until = until;
  if (r.step < until) start(bit(lane));
}

void LaneIntegrator::clear(int lane) { run_[size_t(lane)].phase = Phase::idle; }

LaneIntegrator::Set LaneIntegrator::run() {
  for (;;) {
    if (const Set done = in(Phase::arrived) | in(Phase::stuck)) return done;
    if (!(in(Phase::sweeping) | in(Phase::finishing))) return 0;
    advance();
  }
}

void LaneIntegrator::state(int lane, phs::State& to) const {
  const Run& r = run_[size_t(lane)];
  to.x.resize(n_), to.lo.resize(n_);
  for (size_t k = 0; k < n_; ++k) to.x[k] = x_[k][lane], to.lo[k] = lo_[k][lane];
  to.turns = r.turns, to.step = r.step;
  to.origin = r.origin, to.origin_lo = r.origin_lo, to.origin_step = r.origin_step;
}

void LaneIntegrator::works(int lane, std::span<double> to) const {
  for (size_t a = 0; a < works_.size(); ++a) to[a] = works_[a][lane];
}

void LaneIntegrator::add(Set lanes, size_t k, Lanes move) {
  Lanes x = x_[k], lo = lo_[k];
  phs::compensated_add(x, lo, move);
  const auto m = mask(lanes);
  x_[k] = select(m, x, x_[k]), lo_[k] = select(m, lo, lo_[k]);
}

void LaneIntegrator::finished(Set lanes) {
  Set next = 0;
  for (int l = 0; l < width; ++l) {
    if (!(lanes & bit(l))) continue;
    Run& r = run_[size_t(l)];
    ++r.step;
    if (options_.wrap) wrap(l);
    if (r.step < r.until)
      next |= bit(l);
    else
      r.phase = Phase::arrived;
  }
  if (next) start(next);
}

void LaneIntegrator::start(Set lanes) {
  for (int l = 0; l < width; ++l) {
    if (!(lanes & bit(l))) continue;
    const Run& r = run_[size_t(l)];
    t_.set(l, r.origin + (r.origin_lo + double(r.step - r.origin_step) * h_));
  }
  begin(lanes);
}

void LaneIntegrator::wrap(int lane) {
  bool any = false;
  for (const size_t k : angles_) any |= std::fabs(x_[k][lane]) > phs::pi_hi;
  if (!any) return;
  Run& r = run_[size_t(lane)];
  phs::State& s = angle_state_;
  for (size_t a = 0; a < angles_.size(); ++a)
    s.x[a] = x_[angles_[a]][lane], s.lo[a] = lo_[angles_[a]][lane];
  s.turns = r.turns;
  if (!phs::wrap_angles(angle_blocks_, s)) return;
  for (size_t a = 0; a < angles_.size(); ++a)
    x_[angles_[a]].set(lane, s.x[a]), lo_[angles_[a]].set(lane, s.lo[a]);
  r.turns = s.turns;
  tell_turns();
}

void LaneIntegrator::tell_turns() {
  if (angles_.empty()) return;
  for (size_t a = 0; a < angles_.size(); ++a)
    for (int l = 0; l < width; ++l)
      turn_angles_[a].set(l, double(run_[size_t(l)].turns[a]) * phs::two_pi_hi);
  system_->set_turn_angles(turn_angles_);
}

std::unique_ptr<LaneIntegrator> make_lane_integrator(const std::string& method,
                                                     const phs::Model& model, double h,
                                                     const Options& options) {
  if (!std::isfinite(h) || h == 0)
    throw InvalidArgument("step is " + std::to_string(h) +
                          " s, expected a finite number other than 0");
  const Entry& e = entry_of(method);
  if (const auto reason = misfit(e.declaration, model.description()))
    throw InvalidArgument(*reason);
  if (!e.make_lanes || !model.holds().empty()) return nullptr;
  return e.make_lanes(e.declaration, model, h, options);
}

}  // namespace porthos::integrators
