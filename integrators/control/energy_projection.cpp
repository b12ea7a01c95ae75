#include "integrators/control/energy_projection.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace porthos::integrators {
namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

}  // namespace

EnergyProjection::EnergyProjection(const phs::Model& model, const phs::Model& keeps)
    : invariants_(keeps),
      n_kept_(size_t(keeps.description().nx)),
      x_(size_t(model.description().nx)),
      e_(x_.size()),
      slope_(x_.size()) {
  for (const auto& b : model.description().blocks)
    for (int k = 0; b.momentum >= 0 && k < b.size; ++k) moving_.push_back(size_t(b.momentum + k));
  if (moving_.empty()) {
    moving_.resize(x_.size());
    std::iota(moving_.begin(), moving_.end(), size_t(0));
  }
  d_.resize(moving_.size());
  v_ = d_;
  if (model.description().constraint_count() > 0) {
    auto system = model.instantiate<double>();
    auto rows = system->constraints();
    const std::vector<double> row(size_t(rows->count()));
    constraints_ = Rows{std::move(system), std::move(rows), row, x_, x_};
  }
  basis_.assign(invariants_.count(), d_);
  trial_ = phs::State(model.description(), x_);
  found_ = found_lo_ = x_;
}

double EnergyProjection::energy(phs::System<double>& system, const phs::State& s) {
  for (size_t i = 0; i < x_.size(); ++i) x_[i] = s.x[i] + s.lo[i];
  return system.hamiltonian(x_);
}

double EnergyProjection::direction(phs::System<double>& system) {
  system.gradient(x_, e_);
  for (size_t k = 0; k < d_.size(); ++k) d_[k] = v_[k] = e_[moving_[k]];
  size_t rank = 0;
  for (size_t i = 0; i < invariants_.count(); ++i) {  // Gram-Schmidt, twice to reduce rounding
    auto& v = basis_[rank];
    invariants_(i, std::span<const double>(x_).first(n_kept_),
                std::span<double>(slope_).first(n_kept_));
    for (size_t k = 0; k < v.size(); ++k) v[k] = slope_[moving_[k]];
    const double size = std::sqrt(dot(v, v));
    for (int twice = 0; twice < 2; ++twice)
      for (size_t j = 0; j < rank; ++j) {
        const double c = dot(v, basis_[j]);
        for (size_t k = 0; k < v.size(); ++k) v[k] -= c * basis_[j][k];
      }
    const double left = std::sqrt(dot(v, v));
    if (!(left > 1e-10 * size)) continue;  // linearly dependent
    for (double& number : v) number /= left;
    ++rank;
  }
  for (int twice = 0; twice < 2; ++twice)
    for (size_t j = 0; j < rank; ++j) {
      const double c = dot(d_, basis_[j]);
      for (size_t k = 0; k < d_.size(); ++k) d_[k] -= c * basis_[j][k];
    }
  if (constraints_) keep_to_constraints(system);
  return dot(v_, d_);
}

void EnergyProjection::keep_to_constraints(phs::System<double>& system) {
  auto& [own, rows, row, push, at_rest] = *constraints_;
  rows->place(x_, row);
  rows->factor(x_);
  const auto set_momenta = [&](const auto& value) {
    for (size_t k = 0; k < d_.size(); ++k) x_[moving_[k]] = value(k);
  };
  for (int twice = 0; twice < 2; ++twice) {
    set_momenta([](size_t) { return 0.0; });
    system.gradient(x_, at_rest);
    set_momenta([&](size_t k) { return d_[k]; });
    system.gradient(x_, e_);
    for (size_t i = 0; i < e_.size(); ++i) e_[i] -= at_rest[i];  // M⁻¹ d
    rows->rates(e_, row);
    rows->solve(row);
    rows->forces(row, push);
    for (size_t k = 0; k < d_.size(); ++k) d_[k] -= push[moving_[k]];
  }
}

bool EnergyProjection::operator()(phs::System<double>& system, phs::State& state, double target) {
  const double start = energy(system, state), goal = target - start;
  const double rounding =
      2 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(start), std::fabs(target));
  if (std::fabs(goal) <= rounding) return true;
  double slope = direction(system);        // dH/dλ along d_, at λ = 0
  const double sign = slope < 0 ? -1 : 1;  // rows that move can turn it round
  for (double& number : d_) number *= sign;
  slope *= sign;
  double lambda = 0, error = -goal, best = std::fabs(goal);
  trial_ = state;
  constexpr int most = 20;  // Newton doubles the digits: 3 or 4 are usual
  for (int i = 0; i < most; ++i) {
    if (!(slope > 0)) return false;  // the minimum energy along d is passed
    lambda -= error / slope;
    trial_.x = state.x;
    trial_.lo = state.lo;
    for (size_t k = 0; k < d_.size(); ++k)
      phs::compensated_add(trial_.x[moving_[k]], trial_.lo[moving_[k]], lambda * d_[k]);
    error = energy(system, trial_) - target;
    if (!std::isfinite(error)) return false;
    const bool better = std::fabs(error) < best;
    if (better) {
      best = std::fabs(error);
      found_.swap(trial_.x);
      found_lo_.swap(trial_.lo);
    }
    if (best <= 0.5 * rounding || (!better && i > 2)) break;
    system.gradient(x_, e_);
    slope = 0;
    for (size_t k = 0; k < d_.size(); ++k) slope += e_[moving_[k]] * d_[k];
  }
  if (!(best <= std::max(rounding, 1e-3 * std::fabs(goal)))) return false;
  state.x = found_;
  state.lo = found_lo_;
  return true;
}

}  // namespace porthos::integrators
