#include "scene/measure.h"

#include <algorithm>
#include <cmath>

namespace porthos::scene {
namespace {

constexpr long double two_pi = 6.283185307179586476925286766559005768394L;

double norm3(const long double* v) {
  return static_cast<double>(std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
}

}  // namespace

bool Measured::finite() const {
  double sum = energy_change_J + kinetic_J + quaternion_norm;  // NaN and inf survive a sum
  for (int k = 0; k < 3; ++k) sum += linear[size_t(k)] + angular[size_t(k)];
  return std::isfinite(sum);
}

Meter::Meter(const Assembly& a)
    : model_(a.model), mechanical_(a.mechanical), system_(a.model->instantiate<Real>()) {
  if (mechanical_) workspace_.emplace(mechanical_->mechanism());
  const phs::Description& d = model_->description();
  x_.resize(size_t(d.nx)), stored_.resize(d.storages.size());
  linear_is_structure_ = linear_momentum_is_structure(a);
  turns_.resize(a.initial.turns.size()), turn_angles_.resize(turns_.size());
  for (const auto& i : d.invariants) {
    if (i.name == "linear_momentum") linear_at_ = i.at;
    if (i.name == "angular_momentum") angular_at_ = i.at;
    if (i.name.rfind("quaternion_norm.", 0) == 0) norms_at_.push_back(size_t(i.at));
  }
  read(a.initial);
  start_ = values();
  system_->stored(x_, stored_);
  kinetic_at_start_ = kinetic(a.initial, {stored_.begin(), stored_.end()});
  size_ = scale_of(a.initial);
  starts_at_rest_ = size_.linear == 0 && size_.angular == 0;
  if (has_linear())
    size_.linear = std::max(size_.linear, norm3(&start_.invariants[size_t(linear_at_)]));
  if (has_angular())
    size_.angular = std::max(size_.angular, norm3(&start_.invariants[size_t(angular_at_)]));
}

Measured Meter::operator()(const phs::State& state) {
  Measured m;
  read(state);
  const Values now = values();
  m.energy_change_J = to_double(now.energy - start_.energy);
  system_->stored(x_, stored_);
  m.stored_J.assign(stored_.begin(), stored_.end());
  for (size_t k = 0; k < 3; ++k) {
    const size_t l = size_t(linear_at_) + k, a = size_t(angular_at_) + k;
    if (has_linear()) m.linear[k] = to_double(now.invariants[l] - start_.invariants[l]);
    if (has_angular()) m.angular[k] = to_double(now.invariants[a] - start_.invariants[a]);
  }
  for (const size_t at : norms_at_) {
    const double off = to_double(std::fabs(std::sqrt(now.invariants[at]) - 1));
    if (!(off <= m.quaternion_norm)) m.quaternion_norm = off;  // keeps a NaN
  }
  m.kinetic_J = kinetic(state, m.stored_J);
  if (starts_at_rest_ && (has_linear() || has_angular())) m.scale = scale_of(state);
  return m;
}

void Meter::read(const phs::State& s) {
  for (size_t i = 0; i < x_.size(); ++i) x_[i] = Real(s.x[i]) + Real(s.lo[i]);
  if (s.turns == turns_) return;
  turns_ = s.turns;
  for (size_t i = 0; i < turns_.size(); ++i) turn_angles_[i] = two_pi * Real(turns_[i]);
  system_->set_turn_angles(turn_angles_);
}

Meter::Values Meter::values() {
  Values v;
  v.energy = system_->hamiltonian(x_);
  v.invariants.resize(size_t(model_->description().invariant_count()));
  system_->invariants(x_, v.invariants);
  return v;
}

double Meter::kinetic(const phs::State& s, const std::vector<double>& stored) {
  if (mechanical_) {
    const auto& m = mechanical_->mechanism();
    const std::span<const double> x(s.x);
    const size_t n = size_t(m.nq());
    return mechanics::kinetic_energy<double>(m, *workspace_, x.first(n), x.subspan(n, n));
  }
  double most = 0;
  for (const double e : stored) most = std::max(most, std::fabs(e));
  return most;
}

mechanics::MomentumScale Meter::scale_of(const phs::State& s) {
  if (!mechanical_) return {0, 0};
  const auto& m = mechanical_->mechanism();
  const std::span<const double> x(s.x);
  const auto v = mechanical_->rates(x.first(size_t(2 * m.nq())));
  return mechanics::momentum_scale(m, *workspace_, x.first(size_t(m.nq())), v);
}

}  // namespace porthos::scene
