#include "scene/run/measure.h"

#include <algorithm>
#include <cmath>

namespace porthos::scene {
namespace {

constexpr long double two_pi = 6.283185307179586476925286766559005768394L;

double size_of(const std::array<long double, 3>& v) {
  return static_cast<double>(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
}

}  // namespace

bool Measured::finite() const {
  double sum = energy_change_J + quaternion_norm + gap + slip;  // NaN and inf survive a sum
  for (const double e : stored_J) sum += e;
  for (int k = 0; k < 3; ++k) sum += linear[size_t(k)] + angular[size_t(k)];
  return std::isfinite(sum);
}

Meter::Meter(const Assembly& a)
    : model_(a.model), mechanical_(a.mechanical), system_(a.model->instantiate<Real>()) {
  if (mechanical_) workspace_.emplace(mechanical_->mechanism());
  const phs::Description& d = model_->description();
  x_.resize(size_t(d.nx));
  stored_.resize(d.storages.size());
  linear_is_structure_ = linear_momentum_is_structure(a);
  invariants_.resize(size_t(d.invariant_count()));
  rows_ = system_->constraints();
  if (rows_) {
    g_.resize(size_t(rows_->count()));
    e_.resize(x_.size());
  }
  now_.stored_J.resize(stored_.size());
  turns_.resize(a.initial.turns.size());
  turn_angles_.resize(turns_.size());
  for (const auto& i : d.invariants) {
    if (i.name == "linear_momentum") linear_ = {i.at, std::min(i.size, 3)};
    if (i.name == "angular_momentum") angular_ = {i.at, std::min(i.size, 3)};
    if (i.name.rfind("quaternion_norm.", 0) == 0) norms_at_.push_back(size_t(i.at));
  }
  if (mechanical_ && has_linear() && has_angular()) measure_from_centre(a.initial);
  read(a.initial);
  start_ = values();
  if (has_linear()) size_.linear = size_of(start_.linear);
  if (has_angular()) size_.angular = size_of(start_.angular);
}

void Meter::measure_from_centre(const phs::State& start) {
  const auto& m = mechanical_->mechanism();
  workspace_->set_turns(start.turns);
  const auto c =
      mechanics::centre_of_mass<double>(m, *workspace_, std::span(start.x).first(size_t(m.nq())));
  for (const auto& block : m.coordinates()) {
    const auto& node = m.nodes()[size_t(block.node)];
    if (node.parent >= 0 || block.kind != phs::BlockKind::linear) continue;
    const auto local = node.placement.R.tmul(c);
    for (int k = 0; k < 3; ++k) shifts_.push_back({size_t(block.q + k), Real(local[k])});
  }
}

const Measured& Meter::measure(double t, const phs::State& state) {
  look(t, state);
  if (mechanical_ && (has_linear() || has_angular())) now_.scale = scale_of(state);
  return now_;
}

const Measured& Meter::look(double t, const phs::State& state) {
  Measured& m = now_;
  if (rows_) rows_->set_time(Real(t));
  read(state);
  const Values now = values();
  m.energy_change_J = double(now.energy - start_.energy);
  std::copy(stored_.begin(), stored_.end(), m.stored_J.begin());
  for (size_t k = 0; k < 3; ++k) {
    m.linear[k] = double(now.linear[k] - start_.linear[k]);
    m.angular[k] = double(now.angular[k] - start_.angular[k]);
  }
  m.quaternion_norm = now.quaternion_norm;
  m.gap = now.gap;
  m.slip = now.slip;
  return m;
}

void Meter::read(const phs::State& s) {
  for (size_t i = 0; i < x_.size(); ++i) x_[i] = Real(s.x[i]) + Real(s.lo[i]);
  for (const auto& [at, by] : shifts_) x_[at] = (Real(s.x[at]) - by) + Real(s.lo[at]);
  if (s.turns == turns_) return;
  turns_ = s.turns;
  for (size_t i = 0; i < turns_.size(); ++i) turn_angles_[i] = two_pi * Real(turns_[i]);
  system_->set_turn_angles(turn_angles_);
  if (rows_) rows_->set_turn_angles(turn_angles_);
}

Meter::Values Meter::values() {
  Values v;
  system_->stored(x_, stored_);
  // For mechanical models the parts make up the whole; a system of the user's own is asked for it.
  if (mechanical_)
    for (const Real e : stored_) v.energy += e;
  else
    v.energy = system_->hamiltonian(x_);
  if (rows_) measure_constraints(v);
  if (invariants_.empty()) return v;
  system_->invariants(x_, invariants_);
  for (size_t k = 0; k < 3; ++k) {
    if (has_linear() && int(k) < linear_.size) v.linear[k] = invariants_[size_t(linear_.at) + k];
    if (has_angular() && int(k) < angular_.size)
      v.angular[k] = invariants_[size_t(angular_.at) + k];
  }
  for (const size_t at : norms_at_) {
    const double off = double(std::fabs(std::sqrt(invariants_[at]) - 1));
    if (!(off <= v.quaternion_norm)) v.quaternion_norm = off;  // keeps a NaN
  }
  return v;
}

void Meter::measure_constraints(Values& v) {
  const auto largest = [&] {
    double most = 0;
    for (const Real x : g_)
      if (const double size = double(std::fabs(x)); !(size <= most)) most = size;  // keeps a NaN
    return most;
  };
  rows_->place(x_, g_);
  v.gap = largest();
  system_->gradient(x_, e_);
  rows_->rates(e_, g_);
  rows_->add_drift(g_);
  v.slip = largest();
}

mechanics::MomentumScale Meter::scale_of(const phs::State& s) {
  const auto& m = mechanical_->mechanism();
  const auto x = std::span<const double>(s.x).first(size_t(2 * m.nq()));
  workspace_->set_turns(s.turns);
  return mechanics::momentum_scale(m, *workspace_, x.first(size_t(m.nq())),
                                   mechanical_->rates(x, s.turns));
}

}  // namespace porthos::scene
