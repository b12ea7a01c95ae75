#include "planning/detail/newton_iteration.h"

#include <cmath>

namespace porthos::planning::detail {
namespace {

/// Of the filter and the line search (Wächter, Biegler 2006, table 2).
constexpr double theta_margin = 1e-5, phi_margin = 1e-8, armijo = 1e-4;
constexpr double shortest_step = 1e-8;

}  // namespace

NewtonIteration::NewtonIteration(const Problem& problem, const Trajectory& guess,
                                 const PlannerOptions& options, bool careful)
    : p_(problem), o_(options), careful_(careful), shooting_(problem) {
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
  const Vector pull = at_.upper - at_.lower;
  gradient_ += pull.head(gradient_.size());
  shooting_.add_path(of_path(pull), gradient_);
  const double scale =
      1 + std::max({at_.lambda.lpNorm<Eigen::Infinity>(), at_.lower.lpNorm<Eigen::Infinity>(),
                    at_.upper.lpNorm<Eigen::Infinity>()});
  Residuals r;
  r.defect = std::max(shooting_.largest_defect(),
                      (path() - at_.c.tail(shooting_.path())).lpNorm<Eigen::Infinity>());
  r.stationarity = gradient_.lpNorm<Eigen::Infinity>() / scale;
  for (const long i : limited_) {
    const auto off = [&](double z, double distance) {
      r.complementarity = std::max(r.complementarity, std::fabs(z * distance - barrier) / scale);
    };
    if (std::isfinite(low_[i])) off(at_.lower[i], at_.c[i] - low_[i]);
    if (std::isfinite(high_[i])) off(at_.upper[i], high_[i] - at_.c[i]);
  }
  return r;
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
  const Vector pull = at_.upper - at_.lower, now = path();
  shooting_.curve(at_.lambda, at_.nu, exact, of_path(pull));
  shooting_.renew_slopes();
  const long nx = shooting_.nx(), nw = shooting_.nw(), N = shooting_.N();
  for (const long i : limited_) {
    const auto [sigma, slope] = barrier_of(i);
    if (i >= shooting_.unknowns()) {
      // its slack s moves by number - s and with the number
      const double off = now[i - shooting_.unknowns()] - at_.c[i];
      shooting_.add_to_programme(i - shooting_.unknowns(), sigma, slope + sigma * off);
    } else if (i >= shooting_.at_w(0)) {
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

/// More on the whole diagonal, states' too, until the programme is convex: shorter steps that know
/// the curvature of f. @param scale  of the second derivatives by inputs
bool NewtonIteration::weigh_all(double scale) {
  regularisation_ = 0;
  double now = 0;
  const double first = last_weight_ > 0 ? std::max(last_weight_ / 3, 1e-8 * scale) : 1e-2 * scale,
               factor = last_weight_ > 0 ? 8 : 30;
  for (double next = first; next < 1e8 * scale; next *= factor) {
    for (auto& s : shooting_.qp.stages) s.H.diagonal().array() += next - now;
    shooting_.qp.last_H.diagonal().array() += next - now;
    now = next;
    if (!try_sweep()) continue;
    last_weight_ = regularisation_ = now;
    return true;
  }
  return false;
}

/// The programme with all second derivatives if it is convex, if need be with a little on the
/// diagonal: an optimum may belong to a family. Else without the second derivatives of f; but near
/// a stationary point that is no minimum such steps creep, and a larger diagonal leads away. If
/// careful, with more on the whole diagonal instead.
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
  for (const double little : {1e-9, 1e-7, 1e-5, 1e-3, 1e-2, 1e-1}) {
    if (ok || !exact || (little > 1e-3 && !nearly_stationary_)) break;
    regularisation_ = little * scale;
    ok = try_sweep();
  }
  if (!ok && exact && careful_) ok = weigh_all(scale);
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
  move.c.resize(at_.c.size());
  move.c.head(move.v.size()) = move.v;
  shooting_.path_along(move.v, move.c.data() + move.v.size());
  move.c.tail(shooting_.path()) += path() - at_.c.tail(shooting_.path());
  move.lower = move.upper = Vector::Zero(move.c.size());
  for (const long i : limited_) {
    const double dc = move.c[i];
    if (std::isfinite(low_[i])) {
      const double d = at_.c[i] - low_[i];
      move.lower[i] = (barrier_ - at_.lower[i] * dc) / d - at_.lower[i];
    }
    if (std::isfinite(high_[i])) {
      const double d = high_[i] - at_.c[i];
      move.upper[i] = (barrier_ + at_.upper[i] * dc) / d - at_.upper[i];
    }
  }
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
  most_infeasible_ = infeasibility(at_.c);
  return search(move);
}

/// Halves the step until the filter takes it, as it is or as a motion.
bool NewtonIteration::search(const Move& move) {
  const Vector v0 = at_.v;
  const double theta0 = infeasibility(at_.c), phi0 = barrier_at(at_.c, shooting_.cost);
  // the slope of the barrier function along the step: that of the Lagrangian's cost part
  double slope = 0;
  const long nx = shooting_.nx(), nw = shooting_.nw();
  for (long k = 0; k < shooting_.N(); ++k) {
    const auto& g = shooting_.qp.stages[size_t(k)].g;
    slope += g.head(nx).dot(move.v.segment(shooting_.at_x(k), nx)) +
             g.tail(nw).dot(move.v.segment(shooting_.at_w(k), nw));
  }
  slope += shooting_.qp.last_g.dot(move.v.segment(shooting_.at_x(shooting_.N()), nx));
  const Vector now = path();
  for (long i = v0.size(); i < at_.c.size(); ++i) {  // of a slack by its own move
    const auto [sigma, own] = barrier_of(i);
    const double off = now[i - v0.size()] - at_.c[i];
    slope += own * off - sigma * off * (move.c[i] - off);
  }
  if (most_infeasible_ == 0) most_infeasible_ = 1e4 * std::max(1.0, theta0);
  const double longest = room(at_.c, move.c),
               dual = std::min(room_of(at_.lower, move.lower), room_of(at_.upper, move.upper));
  Vector trial;
  for (double alpha = longest; alpha > shortest_step; alpha *= 0.5)
    for (const bool along_a_motion : {false, true}) {
      ++evaluations_;
      if (!along_a_motion) trial = v0 + alpha * move.v;
      const bool solved = along_a_motion ? shooting_.follow(v0, move.v, alpha, sweep_, trial)
                                         : shooting_.evaluate(trial);
      if (!solved) continue;
      const Vector c = joined(trial, moved_slacks(move, alpha));
      if (inside(c) &&
          accept(infeasibility(c), barrier_at(c, shooting_.cost), alpha, slope, theta0, phi0)) {
        take(move, alpha, dual, trial);
        return true;
      }
    }
  return false;
}

}  // namespace porthos::planning::detail
