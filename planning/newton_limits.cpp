#include <algorithm>
#include <cmath>

#include "planning/detail/newton_iteration.h"

/// What the limits of a problem ask of Newton's iteration: a barrier, and steps that stay inside.
namespace porthos::planning::detail {

void NewtonIteration::set_limits() {
  shooting_.limits(low_, high_);
  for (long i = 0; i < low_.size(); ++i)
    if (std::isfinite(low_[i]) || std::isfinite(high_[i])) limited_.push_back(i);
}

namespace {

/// x, or a margin inside the limits. margin(limit): the room that is left beside one
template <class Margin>
double moved_inside(double x, double low, double high, const Margin& margin) {
  if (std::isfinite(low)) x = std::max(x, low + margin(low));
  if (std::isfinite(high)) x = std::min(x, high - margin(high));
  return x;
}

}  // namespace

/// The barrier needs room: a hundredth of the width, or of 1 + |limit|.
void NewtonIteration::move_inside(Vector& v) const {
  for (const long i : limited_) {
    if (i >= v.size()) break;  // those at stages follow
    const double width = high_[i] - low_[i];
    v[i] = moved_inside(v[i], low_[i], high_[i], [&](double limit) {
      return 0.01 * std::min(1 + std::fabs(limit), std::isfinite(width) ? width : HUGE_VAL);
    });
  }
}

/// Solves the intervals of the guess, with the first slacks and multipliers.
bool NewtonIteration::begin() {
  if (!shooting_.evaluate(at_.v)) return false;
  const long n = at_.v.size();
  at_.c = joined(at_.v, path());
  for (long i = n; i < at_.c.size(); ++i) {  // a quarter of the width leaves room
    const double width = high_[i] - low_[i];
    at_.c[i] = moved_inside(at_.c[i], low_[i], high_[i], [&](double limit) {
      return std::isfinite(width) ? 0.25 * width : 0.1 * (1 + std::fabs(limit));
    });
  }
  at_.lower = at_.upper = Vector::Zero(at_.c.size());
  for (const long i : limited_) {
    if (std::isfinite(low_[i])) at_.lower[i] = barrier_ / (at_.c[i] - low_[i]);
    if (std::isfinite(high_[i])) at_.upper[i] = barrier_ / (high_[i] - at_.c[i]);
  }
  return true;
}

Vector NewtonIteration::joined(const Vector& v, const Vector& slacks) {
  Vector c(v.size() + slacks.size());
  c << v, slacks;
  return c;
}

/// The numbers with limits at the stages that the intervals were solved for.
Vector NewtonIteration::path() const {
  Vector r(shooting_.path());
  shooting_.copy_path(r.data());
  return r;
}

Vector NewtonIteration::moved_slacks(const Move& move, double alpha) const {
  return at_.c.tail(shooting_.path()) + alpha * move.c.tail(shooting_.path());
}

/// How far the equations are violated, those of the slacks in c included.
double NewtonIteration::infeasibility(const Vector& c) const {
  return shooting_.infeasibility() + (path() - c.tail(shooting_.path())).lpNorm<1>();
}

/// The second and first derivative by number i that the barrier gives, with its multipliers.
std::pair<double, double> NewtonIteration::barrier_of(long i) const {
  double sigma = 0, slope = 0;
  if (std::isfinite(low_[i])) {
    sigma += at_.lower[i] / (at_.c[i] - low_[i]);
    slope -= barrier_ / (at_.c[i] - low_[i]);
  }
  if (std::isfinite(high_[i])) {
    sigma += at_.upper[i] / (high_[i] - at_.c[i]);
    slope += barrier_ / (high_[i] - at_.c[i]);
  }
  return {sigma, slope};
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

double NewtonIteration::barrier_at(const Vector& c, double cost) const {
  for (const long i : limited_) {
    if (std::isfinite(low_[i])) cost -= barrier_ * std::log(c[i] - low_[i]);
    if (std::isfinite(high_[i])) cost -= barrier_ * std::log(high_[i] - c[i]);
  }
  return cost;
}

/// The longest step that keeps a part of the distance to every limit.
double NewtonIteration::room(const Vector& c, const Vector& dc) const {
  const double keep = std::max(0.99, 1 - barrier_);
  double alpha = 1;
  for (const long i : limited_) {
    if (dc[i] < 0 && std::isfinite(low_[i]))
      alpha = std::min(alpha, -keep * (c[i] - low_[i]) / dc[i]);
    if (dc[i] > 0 && std::isfinite(high_[i]))
      alpha = std::min(alpha, keep * (high_[i] - c[i]) / dc[i]);
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

bool NewtonIteration::inside(const Vector& c) const {
  for (const long i : limited_)
    if (!(c[i] > low_[i] && c[i] < high_[i])) return false;
  return true;
}

/// Moves by a part of the step to v, and the slacks and multipliers with it.
void NewtonIteration::take(const Move& move, double alpha, double alpha_dual, const Vector& v) {
  at_.v = v;
  at_.c = joined(v, moved_slacks(move, alpha));
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
    if (std::isfinite(low_[i])) keep(at_.lower[i], at_.c[i] - low_[i]);
    if (std::isfinite(high_[i])) keep(at_.upper[i], high_[i] - at_.c[i]);
  }
  last_step_ = alpha;
}

}  // namespace porthos::planning::detail
