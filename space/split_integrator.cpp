#include "space/split_integrator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/rotation.h"
#include "phs/system/power_names.h"
#include "space/split_scheme.h"

namespace porthos::space {

using integrators::Outcome;

namespace {

integrators::Declaration declare(const SplitScheme& scheme, const std::string& method) {
  integrators::Declaration d = integrators::declaration_of(method);
  d.title = "orbit and internal motion split, " + scheme.title + "; internal motion by " + method;
  d.family = "splitting of orbit and internal motion";
  d.order = scheme.order;
  d.energy_exact = d.passivity_exact = integrators::Claim::fails;
  d.needs = {};
  d.source = scheme.source;
  return d;
}

}  // namespace

SplitIntegrator::SplitIntegrator(const Spacecraft& model, double h, const SplitOptions& o)
    : SplitIntegrator(integrators::OfRun(model), model, h, o) {}

SplitIntegrator::SplitIntegrator(const integrators::OfRun& run, const Spacecraft& model, double h,
                                 const SplitOptions& o)
    : BasicIntegrator(declare(split_scheme(o.splitting), o.method), *run.model, h, o.options),
      model_(model),
      scheme_(split_scheme(o.splitting)),
      internal_(run.kept ? std::make_unique<integrators::RunModel>(model.internal(), *run.kept)
                         : nullptr),
      inner_(o.method_for(internal_ ? *internal_ : model.internal(), h)),
      gradient_(model.mechanism()),
      push_(model.mechanism(), model.parts(), model.orbit().environment().planet),
      plates_(model.mechanism(), model.orbit().environment().plates),
      has_plates_(!model.orbit().environment().plates.empty()),
      w_(model.mechanism()),
      n_internal_(model.internal_size()),
      nq_(size_t(model.mechanism().nq())),
      inside_(model.internal().description(), std::vector<double>(n_internal_, 0.0)),
      q_(nq_),
      change_(nq_),
      middle_(nq_),
      place_(2 * nq_),
      turn_angles_(size_t(model.mechanism().angle_count()), 0.0),
      extra_(nq_, 0.0),
      delta_(nq_),
      slope_(nq_),
      side_(nq_),
      linkage_(model.mechanical().instantiate<double>()),
      loops_(linkage_->constraints()),
      e_(loops_ ? 2 * nq_ : 0),
      lambda_(loops_ ? size_t(loops_->count()) : 0),
      rows_(lambda_.size()),
      taken_(e_.size()),
      kicked_(loops_ ? nq_ : 0) {
  keep_model(run.kept);
  for (const auto& n : model.mechanism().nodes())
    if (n.parent < 0) roots_.push_back(size_t(n.q));
  if (!scheme_.forward && !model.description().traits.lossless)
    throw InvalidArgument("splitting '" + scheme_.name +
                          "' steps backwards inside a step and the internal motion is damped by " +
                          phs::power_names(model.description(), true) +
                          ", expected strang, lobatto4, lobatto6 or lobatto8");
}

void SplitIntegrator::gather(const State& s) {
  std::copy_n(s.x.begin(), n_internal_, inside_.x.begin());
  std::copy_n(s.lo.begin(), n_internal_, inside_.lo.begin());
  if (inside_.turns == s.turns) return;
  inside_.turns = s.turns;
  for (size_t i = 0; i < turn_angles_.size(); ++i)
    turn_angles_[i] = double(s.turns[i]) * phs::two_pi_hi;
  gradient_.set_turn_angles(turn_angles_);
  plates_.set_turn_angles(turn_angles_);
  push_.set_turn_angles(turn_angles_);
  w_.turn_angle = turn_angles_;
  if (!loops_) return;
  linkage_->set_turn_angles(turn_angles_);
  loops_->set_turn_angles(turn_angles_);
}

void SplitIntegrator::scatter(State& s) const {
  std::copy(inside_.x.begin(), inside_.x.end(), s.x.begin());
  std::copy(inside_.lo.begin(), inside_.lo.end(), s.lo.begin());
}

void SplitIntegrator::pull(const OrbitPoint& p) {
  for (size_t i = 0; i < nq_; ++i) q_[i] = inside_.x[i] + inside_.lo[i];
  gradient_.evaluate(model_.orbit().environment().planet.mu, q_, Vec3d(p.r));
}

SpaceLedgers::Reading SplitIntegrator::read(const OrbitPoint& p) const {
  return {.orbital = model_.orbit().energy(p),
          .gradient = gradient_.energy(),
          .zonal = double(model_.orbit().zonal_energy(p)),
          .L = angular_momentum(),
          .reach = gradient_.reach(),
          .distance = mechanics::norm(Vec3d(p.r))};
}

Vec3<OrbitReal> SplitIntegrator::angular_momentum() const {
  // ½ Im(π ξ̄) + r × P of each tree; if there is only one, P is zero
  using Q = mechanics::Quaternion<OrbitReal>;
  Vec3<OrbitReal> L{0, 0, 0};
  for (const size_t root : roots_) {
    OrbitReal x[7], p[7];
    for (size_t k = 0; k < 7; ++k) {
      x[k] = OrbitReal(inside_.x[root + k]) + inside_.lo[root + k];
      p[k] = OrbitReal(inside_.x[nq_ + root + k]) + inside_.lo[nq_ + root + k];
    }
    L += OrbitReal(0.5) * (Q::load(p + base_attitude) * Q::load(x + base_attitude).conj()).v;
    if (roots_.size() > 1) L += cross(Vec3<OrbitReal>{x[0], x[1], x[2]}, {p[0], p[1], p[2]});
  }
  return L;
}

/// The angular momentum about the centre of mass of momenta that are added at q_.
Vec3d SplitIntegrator::impulse_of(std::span<const double> added) const {
  using Q = mechanics::Quaternion<double>;
  Vec3d sum{0, 0, 0};
  for (const size_t root : roots_) {
    const double *x = &q_[root], *p = &added[root];
    sum += 0.5 * (Q::load(p + base_attitude) * Q::load(x + base_attitude).conj()).v;
    if (roots_.size() > 1) sum += cross(Vec3d{x[0], x[1], x[2]}, Vec3d{p[0], p[1], p[2]});
  }
  return sum;
}

void SplitIntegrator::keep_loops(std::span<double> momenta, bool moving) {
  std::copy(q_.begin(), q_.end(), place_.begin());
  std::copy(momenta.begin(), momenta.end(), place_.begin() + long(nq_));
  loops_->place(place_, lambda_);
  linkage_->gradient(place_, e_);
  loops_->rates(e_, lambda_);
  if (moving) loops_->add_drift(lambda_);
  loops_->factor(place_);
  loops_->solve(lambda_);
  loops_->forces(lambda_, taken_);
  for (size_t i = 0; i < nq_; ++i) momenta[i] -= taken_[nq_ + i];
}

void SplitIntegrator::kick_along_loops() {
  for (size_t i = 0; i < nq_; ++i)
    kicked_[i] = inside_.x[nq_ + i] + (inside_.lo[nq_ + i] + change_[i]);
  keep_loops(kicked_, true);
  for (size_t i = 0; i < nq_; ++i) change_[i] -= taken_[nq_ + i];
  std::fill(rows_.begin(), rows_.end(), 0.0);
  loops_->add_drift(rows_);
  for (const auto& block : model_.description().constraints)
    if (block.moving && block.power >= 0 && port_work_.any())
      for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r)
        port_work_.add(size_t(block.power), lambda_[r] * rows_[r]);
}

/// Adds weight [(δ·∂)F + ∂T/∂q(q, F)] at q_ to extra_.
void SplitIntegrator::correct(double weight, const OrbitPoint& p) {
  gradient_.momentum_rates(q_, change_);
  if (loops_) keep_loops(change_, false);
  mechanics::hamiltonian_field<double>(model_.mechanism(), w_, q_, change_, {}, delta_, slope_);
  double size = 0;
  for (const double d : delta_) size = std::max(size, std::fabs(d));
  if (size == 0) return;
  const double mu = model_.orbit().environment().planet.mu, step = 1e-4 / size;
  const Vec3d R(p.r);
  for (size_t i = 0; i < nq_; ++i) extra_[i] -= weight * slope_[i];
  for (const double sign : {1.0, -1.0}) {
    for (size_t i = 0; i < nq_; ++i) side_[i] = q_[i] + sign * step * delta_[i];
    gradient_.evaluate(mu, side_, R);
    gradient_.momentum_rates(side_, slope_);
    if (loops_) {
      std::copy(side_.begin(), side_.end(), place_.begin());
      loops_->place(place_, rows_);
      loops_->forces(lambda_, taken_);
      for (size_t i = 0; i < nq_; ++i) slope_[i] -= taken_[nq_ + i];
    }
    for (size_t i = 0; i < nq_; ++i) extra_[i] += sign * weight / (2 * step) * slope_[i];
  }
  gradient_.evaluate(mu, q_, R);
  // The lift of a body momentum has no part along the quaternion; the momenta of all trees sum to
  // zero.
  double others[3] = {0, 0, 0};
  for (const size_t root : roots_) {
    const size_t a = root + base_attitude;
    double along = 0;
    for (size_t k = a; k < a + 4; ++k) along += extra_[k] * q_[k];
    for (size_t k = a; k < a + 4; ++k) extra_[k] -= along * q_[k];
    for (size_t k = 0; k < 3; ++k)
      if (root != 0) others[k] += extra_[root + k];
  }
  for (size_t k = 0; k < 3; ++k) extra_[base_position + k] = -others[k];
}

void SplitIntegrator::kick(double t, double h, double middle, double correction, OrbitPoint& p) {
  pull(p);
  if (loops_) loops_->set_time(t);
  const bool more = correction != 0 || has_plates_;
  if (more) std::fill(extra_.begin(), extra_.end(), 0.0);
  if (correction != 0) correct(correction, p);
  if (has_plates_) plates_.place(q_);
  const double mass = model_.orbit().mass();
  OrbitWorks works;
  model_.orbit().kick(p, t, h, Vec3<OrbitReal>((1 / mass) * gradient_.reaction()), works,
                      has_plates_ ? &plates_ : nullptr, correction);
  Vec3d impulse = h * gradient_.torque();
  if (correction != 0) impulse += impulse_of(extra_);
  if (has_plates_) {
    plates_.project();
    plates_.momentum_rates(q_, side_);
    impulse += h * plates_.torque();
    for (size_t i = 0; i < nq_; ++i) extra_[i] += h * side_[i];
  }

  gradient_.momentum_rates(q_, change_);
  if (push_.count() > 0) {
    for (size_t i = 0; i < nq_; ++i) {
      place_[i] = q_[i];
      place_[nq_ + i] = inside_.x[nq_ + i] + inside_.lo[nq_ + i];
    }
    push_.evaluate(place_, Vec3d(p.r), t, middle);
    for (size_t k = 0; k < push_.count(); ++k)
      push_.momentum_rates(q_, push_.joint_forces(k), change_);
  }
  for (size_t i = 0; i < nq_; ++i) change_[i] = h * change_[i] + (more ? extra_[i] : 0.0);
  if (loops_) kick_along_loops();
  for (size_t k = 0; k < 3; ++k) {  // the sum over all trees stays zero
    double others = 0;
    for (const size_t root : roots_)
      if (root != 0) others += change_[root + k];
    change_[base_position + k] = -others;
  }
  for (size_t i = 0; i < nq_; ++i)
    middle_[i] = inside_.x[nq_ + i] + (inside_.lo[nq_ + i] + 0.5 * change_[i]);
  if (correction != 0)  // leaves the rates as well
    mechanics::hamiltonian_field<double>(model_.mechanism(), w_, q_, middle_, {}, delta_, slope_);
  else
    mechanics::rates_from_momenta<double>(model_.mechanism(), w_, q_, middle_);
  const auto work_of = [&](std::span<const double> force) {
    double power = 0;
    for (size_t j = 0; j < force.size(); ++j) power += force[j] * w_.rate[j];
    return h * power;
  };
  double work = work_of(gradient_.joint_forces());
  const double by_plates = has_plates_ ? work_of(plates_.joint_forces()) : 0;
  if (correction != 0)
    for (size_t i = 0; i < nq_; ++i)
      work += (extra_[i] - (has_plates_ ? h * side_[i] : 0)) * delta_[i];
  for (size_t i = 0; i < nq_; ++i)
    phs::compensated_add(inside_.x[nq_ + i], inside_.lo[nq_ + i], change_[i]);

  for (size_t k = 0; k < push_.count(); ++k) {
    // After all other kicks at the same position, so that the works add up exactly.
    const Vec3<OrbitReal> dv(Vec3d((h / mass) * push_.force(k)));
    const Vec3<OrbitReal> mean = p.v + OrbitReal(0.5) * dv;
    works[size_t(OrbitSource::thrust)] += OrbitReal(mass) * dot(dv, mean);
    p.v += dv;
    impulse += h * push_.torque(k);
  }
  ledgers_.kick(works, work, impulse, by_plates);
  if (!port_work_.any()) return;
  size_t at = inner_->port_work().size();
  port_work_.add(at++, work);
  size_t impulses = at + push_.count();
  for (size_t k = 0; k < push_.count(); ++k) {
    port_work_.add(at++, work_of(push_.joint_forces(k)));
    const bool has_force = k < model_.parts().forces();
    for (const Vec3d* give : {&push_.force(k), &push_.torque(k)})
      for (int c = 0; c < 3 && (has_force || give == &push_.torque(k)); ++c)
        port_work_.add(impulses++, h * (*give)[c]);
  }
  if (has_plates_) port_work_.add(impulses, by_plates);
}

void SplitIntegrator::begin(const State& s) {
  if (ledgers_.started()) return;
  gather(s);
  const OrbitPoint p =
      load_point(std::span(s.x).subspan(n_internal_), std::span(s.lo).subspan(n_internal_));
  pull(p);
  ledgers_.start(read(p));
}

Outcome SplitIntegrator::advance(double t, double h, State& s) {
  begin(s);
  gather(s);
  const std::span<double> x(s.x), lo(s.lo);
  OrbitPoint p = load_point(x.subspan(n_internal_), lo.subspan(n_internal_));
  const SpaceLedgers before = ledgers_;
  inner_before_.clear();
  inner_->save(inner_before_);
  port_work_.restart();
  double here = t;
  for (size_t i = 0; i < scheme_.kick.size(); ++i) {
    const bool end = i == 0 || i + 1 == scheme_.kick.size();
    if (scheme_.kick[i] != 0)
      kick(here, scheme_.kick[i] * h, t + 0.5 * h, end ? scheme_.corrector * h * h * h : 0, p);
    if (i == scheme_.drift.size()) break;
    const double dt = scheme_.drift[i] * h;
    const Outcome o = inner_->advance_with_port_work(here, dt, inside_);
    if (o != Outcome::ok) {
      ledgers_ = before;
      inner_->restore(inner_before_);
      return o;
    }
    auto count = inner_->cost();
    ++count.steps;
    inner_->set_cost(count);  // advance() leaves counting to its caller
    const auto own = inner_->port_work();
    for (size_t a = 0; a < own.size(); ++a) port_work_.add(a, own[a]);
    if (const auto after = model_.orbit().drift_above_surface(p, dt)) {
      trouble_ = fmt::format("below the surface at t = {:.10g} s", here + *after);
      ledgers_ = before;
      return Outcome::failed;
    }
    here += dt;
  }
  if (scheme_.kick.back() == 0) pull(p);  // otherwise the last kick was here
  ledgers_.look(read(p));
  scatter(s);
  store_point(p, x.subspan(n_internal_), lo.subspan(n_internal_));
  return Outcome::ok;
}

void SplitIntegrator::carry(Archive& a) {
  ledgers_.carry(a);
  inner_->carry(a);
}

integrators::Cost SplitIntegrator::cost() const {
  integrators::Cost c = inner_->cost();
  c.steps = cost_.steps;
  return c;
}

void SplitIntegrator::set_cost(const integrators::Cost& c) {
  inner_->set_cost(c);
  cost_ = c;
}

}  // namespace porthos::space
