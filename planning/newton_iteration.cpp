#include "planning/detail/newton_iteration.h"

#include <cmath>

namespace porthos::planning::detail {
namespace {

/// Of the filter and the line search (Wächter, Biegler 2006, table 2).
constexpr double theta_margin = 1e-5, phi_margin = 1e-8, armijo = 1e-4;
constexpr double shortest_step = 1e-8;

}  // namespace

NewtonIteration::NewtonIteration(const Problem& problem, const Trajectory& guess,
                                 const PlannerOptions& options)
    : p_(problem), o_(options), shooting_(problem) {
  const long n = shooting_.unknowns(), nx = shooting_.nx();
  at_.v.resize(n);
  std::copy(guess.x.begin(), guess.x.end(), at_.v.data());
  std::copy(guess.u.begin(), guess.u.end(), at_.v.data() + shooting_.at_w(0));
  for (long i = 0; i < nx; ++i) at_.v[i] = p_.start[size_t(i)];
  set_limits();
  move_inside(at_.v);
  at_.lambda = Vector::Zero((shooting_.N() + 1) * nx);
  at_.nu = Vector::Zero(long(p_.goals.size()));
  barrier_ = limited_.empty() ? 0 : o_.first_barrier;
  at_.lower = at_.upper = Vector::Zero(n);
  for (const long i : limited_) {
    if (std::isfinite(low_[i])) at_.lower[i] = barrier_ / (at_.v[i] - low_[i]);
    if (std::isfinite(high_[i])) at_.upper[i] = barrier_ / (high_[i] - at_.v[i]);
  }
}

void NewtonIteration::set_limits() {
  const long n = shooting_.unknowns(), nx = shooting_.nx(), N = shooting_.N();
  low_ = Vector::Constant(n, -no_limit);
  high_ = Vector::Constant(n, no_limit);
  std::vector<bool> fixed(size_t(nx), false);  // by a goal, at the end
  for (const Goal& g : p_.goals)
    for (const auto& [k, factor] : g.row) fixed[size_t(k)] = true;
  const auto set = [&](const std::vector<double>& list, Vector& to, long at, bool last) {
    for (size_t i = 0; i < list.size(); ++i)
      if (!last || !fixed[i]) to[at + long(i)] = list[i];
  };
  for (long k = 1; k <= N; ++k) {
    set(p_.limits.state_lower, low_, shooting_.at_x(k), k == N);
    set(p_.limits.state_upper, high_, shooting_.at_x(k), k == N);
  }
  const long nu = p_.dynamics->nu();
  for (long at = shooting_.at_w(0); at < n; at += nu) {
    set(p_.limits.input_lower, low_, at, false);
    set(p_.limits.input_upper, high_, at, false);
  }
  for (long i = 0; i < n; ++i)
    if (std::isfinite(low_[i]) || std::isfinite(high_[i])) limited_.push_back(i);
}

/// The barrier needs room: a hundredth of the width, or of 1 + |limit|.
void NewtonIteration::move_inside(Vector& v) const {
  for (const long i : limited_) {
    const double width = high_[i] - low_[i];
    const auto margin = [&](double limit) {
      return 0.01 * std::min(1 + std::fabs(limit), std::isfinite(width) ? width : HUGE_VAL);
    };
    if (std::isfinite(low_[i])) v[i] = std::max(v[i], low_[i] + margin(low_[i]));
    if (std::isfinite(high_[i])) v[i] = std::min(v[i], high_[i] - margin(high_[i]));
  }
}

/// Those that violate stationarity least, in the sum of squares: the multipliers of the projection
/// of the cost's slope onto the moves that the equations allow.
void NewtonIteration::estimate_multipliers() {
  const long z = shooting_.nx() + shooting_.nw();
  for (auto& s : shooting_.qp.stages) s.H = Matrix::Identity(z, z);
  shooting_.qp.last_H = Matrix::Identity(shooting_.nx(), shooting_.nx());
  shooting_.renew_slopes();
  shooting_.set_equations(Vector::Zero(shooting_.defects.size()),
                          Vector::Zero(shooting_.goals.size()));
  if (sweep_.solve(shooting_.qp, 0, 0) == RiccatiQp::Result::ok) {
    for (long k = 0; k <= shooting_.N(); ++k)
      at_.lambda.segment(k * shooting_.nx(), shooting_.nx()) = sweep_.lambda[size_t(k)];
    at_.nu = sweep_.nu;
  }
  shooting_.set_equations(shooting_.defects, shooting_.goals);
}

/// How far the conditions are violated at the iterate, with the complementarity aimed at `barrier`.
NewtonIteration::Residuals NewtonIteration::residuals(double barrier) {
  shooting_.slope(at_.lambda, at_.nu, gradient_);
  gradient_ += at_.upper - at_.lower;
  const double scale =
      1 + std::max({at_.lambda.lpNorm<Eigen::Infinity>(), at_.lower.lpNorm<Eigen::Infinity>(),
                    at_.upper.lpNorm<Eigen::Infinity>()});
  Residuals r;
  r.defect = shooting_.largest_defect();
  r.stationarity = gradient_.lpNorm<Eigen::Infinity>() / scale;
  for (const long i : limited_) {
    const auto off = [&](double z, double distance) {
      r.complementarity = std::max(r.complementarity, std::fabs(z * distance - barrier) / scale);
    };
    if (std::isfinite(low_[i])) off(at_.lower[i], at_.v[i] - low_[i]);
    if (std::isfinite(high_[i])) off(at_.upper[i], high_[i] - at_.v[i]);
  }
  return r;
}

/// The next barrier, once the conditions of this one hold. @return whether it changed
bool NewtonIteration::lower_barrier() {
  const double least = 0.1 * o_.tolerance;
  bool changed = false;
  while (barrier_ > least && residuals(barrier_).largest() <= 10 * barrier_) {
    barrier_ = std::max(least, std::min(0.2 * barrier_, std::pow(barrier_, 1.5)));
    changed = true;
  }
  if (changed) filter_.clear();
  return changed;
}

double NewtonIteration::barrier_at(const Vector& v, double cost) const {
  for (const long i : limited_) {
    if (std::isfinite(low_[i])) cost -= barrier_ * std::log(v[i] - low_[i]);
    if (std::isfinite(high_[i])) cost -= barrier_ * std::log(high_[i] - v[i]);
  }
  return cost;
}

/// The weight at which ½ρ|Cx + c|² is as large as the cost of the last inputs.
double NewtonIteration::rho_unit() const {
  const auto& last = shooting_.qp.stages.back();
  const double own = last.H.diagonal().tail(shooting_.nw()).cwiseAbs().maxCoeff(),
               goal = (shooting_.qp.C * last.B).colwise().squaredNorm().maxCoeff();
  return goal > 0 ? (own > 0 ? own : 1) / goal : 1;
}

bool NewtonIteration::try_sweep() {
  return sweep_.solve(shooting_.qp, regularisation_, rho_, o_.any_extremal) ==
         RiccatiQp::Result::ok;
}

/// The quadratic programme at the iterate, with the barrier's part eliminated.
void NewtonIteration::set_up(bool exact) {
  shooting_.curve(at_.lambda, at_.nu, exact);
  shooting_.renew_slopes();
  const long nx = shooting_.nx(), nw = shooting_.nw(), N = shooting_.N();
  for (const long i : limited_) {
    double sigma = 0, slope = 0;
    if (std::isfinite(low_[i])) {
      sigma += at_.lower[i] / (at_.v[i] - low_[i]);
      slope -= barrier_ / (at_.v[i] - low_[i]);
    }
    if (std::isfinite(high_[i])) {
      sigma += at_.upper[i] / (high_[i] - at_.v[i]);
      slope += barrier_ / (high_[i] - at_.v[i]);
    }
    if (i >= shooting_.at_w(0)) {
      auto& s = shooting_.qp.stages[size_t((i - shooting_.at_w(0)) / nw)];
      const long at = nx + (i - shooting_.at_w(0)) % nw;
      s.H(at, at) += sigma;
      s.g[at] += slope;
    } else if (i / nx < N) {
      auto& s = shooting_.qp.stages[size_t(i / nx)];
      s.H(i % nx, i % nx) += sigma;
      s.g[i % nx] += slope;
    } else {
      shooting_.qp.last_H(i % nx, i % nx) += sigma;
      shooting_.qp.last_g[i % nx] += slope;
    }
  }
}

/// The programme with all second derivatives if it is convex, if need be with a little on the
/// diagonal: an optimum may belong to a family. Else without the second derivatives of f.
bool NewtonIteration::step(Move& move, bool exact) {
  set_up(exact);
  const auto& last = shooting_.qp.stages.back().H;
  const double unit = rho_unit(),
               scale = std::max(1e-8, last.diagonal().tail(shooting_.nw()).cwiseAbs().maxCoeff());
  regularisation_ = 0;
  bool ok = try_sweep();
  for (const double rho : {10 * unit, 1e4 * unit}) {
    if (ok || p_.goals.empty()) break;
    if (rho <= rho_) continue;
    rho_ = rho;
    ok = try_sweep();
  }
  for (const double little : {1e-9, 1e-7, 1e-5, 1e-3}) {
    if (ok || !exact) break;
    regularisation_ = little * scale;
    ok = try_sweep();
  }
  if (!ok && exact) {
    set_up(false);
    regularisation_ = 0;
    ok = try_sweep();
  }
  if (!ok) regularisation_ = last_regularisation_ > 0 ? last_regularisation_ / 4 : 1e-4 * scale;
  while (!ok && regularisation_ < 1e12 * scale) {
    ok = try_sweep();
    if (!ok) regularisation_ *= 6;
    last_regularisation_ = regularisation_;
  }
  if (ok) read_move(move);
  return ok;
}

void NewtonIteration::read_move(Move& move) const {
  const long nx = shooting_.nx(), nw = shooting_.nw(), N = shooting_.N();
  move.v.resize(shooting_.unknowns());
  move.lambda.resize((N + 1) * nx);
  for (long k = 0; k <= N; ++k) {
    move.v.segment(shooting_.at_x(k), nx) = sweep_.x[size_t(k)];
    move.lambda.segment(k * nx, nx) = sweep_.lambda[size_t(k)] - at_.lambda.segment(k * nx, nx);
  }
  for (long k = 0; k < N; ++k) move.v.segment(shooting_.at_w(k), nw) = sweep_.w[size_t(k)];
  move.nu = sweep_.nu - at_.nu;
  move.lower = move.upper = Vector::Zero(shooting_.unknowns());
  for (const long i : limited_) {
    const double dv = move.v[i];
    if (std::isfinite(low_[i])) {
      const double d = at_.v[i] - low_[i];
      move.lower[i] = (barrier_ - at_.lower[i] * dv) / d - at_.lower[i];
    }
    if (std::isfinite(high_[i])) {
      const double d = high_[i] - at_.v[i];
      move.upper[i] = (barrier_ + at_.upper[i] * dv) / d - at_.upper[i];
    }
  }
}

/// The longest step that keeps a part of the distance to every limit.
double NewtonIteration::room(const Vector& v, const Vector& dv) const {
  const double keep = std::max(0.99, 1 - barrier_);
  double alpha = 1;
  for (const long i : limited_) {
    if (dv[i] < 0 && std::isfinite(low_[i]))
      alpha = std::min(alpha, -keep * (v[i] - low_[i]) / dv[i]);
    if (dv[i] > 0 && std::isfinite(high_[i]))
      alpha = std::min(alpha, keep * (high_[i] - v[i]) / dv[i]);
  }
  return alpha;
}

double NewtonIteration::room_of(const Vector& z, const Vector& dz) const {
  const double keep = std::max(0.99, 1 - barrier_);
  double alpha = 1;
  for (const long i : limited_)
    if (dz[i] < 0 && z[i] > 0) alpha = std::min(alpha, -keep * z[i] / dz[i]);
  return alpha;
}

bool NewtonIteration::inside(const Vector& v) const {
  for (const long i : limited_)
    if (!(v[i] > low_[i] && v[i] < high_[i])) return false;
  return true;
}

/// Moves by a part of the step to v, and the multipliers with it.
void NewtonIteration::take(const Move& move, double alpha, double alpha_dual, const Vector& v) {
  at_.v = v;
  at_.lambda += alpha * move.lambda;
  at_.nu += alpha * move.nu;
  at_.lower += alpha_dual * move.lower;
  at_.upper += alpha_dual * move.upper;
  constexpr double far = 1e10;  // multipliers stay near barrier / distance
  for (const long i : limited_) {
    const auto keep = [&](double& z, double distance) {
      const double own = barrier_ / distance;
      z = std::min(std::max(z, own / far), own * far);
    };
    if (std::isfinite(low_[i])) keep(at_.lower[i], v[i] - low_[i]);
    if (std::isfinite(high_[i])) keep(at_.upper[i], high_[i] - v[i]);
  }
  last_step_ = alpha;
}

/// Whether the filter takes a trial step; a step that only lessens the infeasibility is remembered.
bool NewtonIteration::accept(double theta, double phi, double alpha, double slope, double theta0,
                             double phi0) {
  if (!std::isfinite(phi) || theta > most_infeasible_) return false;
  const double noise = 10 * 0x1p-52 * (1 + std::fabs(phi0));
  for (const auto& [t, f] : filter_)
    if (theta >= (1 - theta_margin) * t && phi >= f - phi_margin * t + noise && theta > 1e-12)
      return false;
  const bool descent =
      slope < 0 && std::pow(-slope, 2.3) * alpha > std::pow(theta0, 1.1) && theta0 < 1e-3;
  if (descent) return phi <= phi0 + armijo * alpha * slope + noise;
  if (theta <= (1 - theta_margin) * theta0 || phi <= phi0 - phi_margin * theta0 || theta <= 1e-12) {
    filter_.push_back({(1 - theta_margin) * theta0, phi0 - phi_margin * theta0});
    return true;
  }
  return false;
}

/// When old iterates block every step, they are forgotten, but the infeasibility must not grow.
bool NewtonIteration::search_afresh(const Move& move) {
  if (filter_.empty()) return false;
  filter_.clear();
  if (!shooting_.evaluate(at_.v)) return false;
  most_infeasible_ = shooting_.infeasibility();
  return search(move);
}

/// Halves the step until the filter takes it, as it is or as a motion.
bool NewtonIteration::search(const Move& move) {
  const Vector v0 = at_.v;
  const double theta0 = shooting_.infeasibility(), phi0 = barrier_at(v0, shooting_.cost);
  // the slope of the barrier function along the step: that of the Lagrangian's cost part
  double slope = 0;
  const long nx = shooting_.nx(), nw = shooting_.nw();
  for (long k = 0; k < shooting_.N(); ++k) {
    const auto& g = shooting_.qp.stages[size_t(k)].g;
    slope += g.head(nx).dot(move.v.segment(shooting_.at_x(k), nx)) +
             g.tail(nw).dot(move.v.segment(shooting_.at_w(k), nw));
  }
  slope += shooting_.qp.last_g.dot(move.v.segment(shooting_.at_x(shooting_.N()), nx));
  if (most_infeasible_ == 0) most_infeasible_ = 1e4 * std::max(1.0, theta0);
  const double longest = room(v0, move.v),
               dual = std::min(room_of(at_.lower, move.lower), room_of(at_.upper, move.upper));
  Vector trial;
  for (double alpha = longest; alpha > shortest_step; alpha *= 0.5)
    for (const bool along_a_motion : {false, true}) {
      ++evaluations_;
      if (!along_a_motion) trial = v0 + alpha * move.v;
      const bool solved = along_a_motion
                              ? shooting_.follow(v0, move.v, alpha, sweep_, trial) && inside(trial)
                              : shooting_.evaluate(trial);
      if (solved && accept(shooting_.infeasibility(), barrier_at(trial, shooting_.cost), alpha,
                           slope, theta0, phi0)) {
        take(move, alpha, dual, trial);
        return true;
      }
    }
  return false;
}

}  // namespace porthos::planning::detail
