#include "contact/friction_impact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::contact {
namespace {

using Across = std::array<double, 2>;

double norm_of(const Across& a) { return std::hypot(a[0], a[1]); }
double along(const Across& a, const Across& b) { return a[0] * b[0] + a[1] * b[1]; }

/// Where a phase ends: with the approach, or when the normal force has done `left` work.
struct Goal {
  bool compresses;
  double left = 0;

  /// How far, for a rate u that changes by a per impulse.
  double at(double u, double a) const {
    if (compresses) return a > 0 ? -u / a : HUGE_VAL;
    return 2 * left / (u + std::sqrt(std::max(u * u + 2 * a * left, 0.0)));  // u p + a p²/2 = left
  }
  /// Negative before it.
  double beyond(double u, double work) const { return compresses ? u : work - left; }
};

/// The impact in progress.
class Progress {
 public:
  Progress(const PointImpact& start, double mu)
      : w_(start.W), mu_(mu), y_{start.u[0], {start.u[1], start.u[2]}} {}

  /// To a goal, in phases.
  void reach(const Goal& whole) {
    const double before = y_.work;
    for (bool done = false; !done;) {
      Goal goal = whole;
      goal.left -= y_.work - before;
      if (!whole.compresses && !(goal.left > 0)) return;
      const double slip = norm_of(y_.t);
      if (!(slip > 0)) {
        const SlipStart next =
            slip_start({w_[1][1], w_[1][2], w_[2][2]}, {w_[1][0], w_[2][0]}, mu_);
        done = straight(goal, next.friction, next.slips);
        continue;
      }
      const Across f{-mu_ * y_.t[0] / slip, -mu_ * y_.t[1] / slip};
      const Across a = change(f).t;
      const double turn = std::fabs(a[0] * y_.t[1] - a[1] * y_.t[0]);
      done = turn <= 1e-13 * slip * (norm_of(a) + mu_ * (w_[1][1] + w_[2][2]))
                 ? straight(goal, f, true)
                 : turning(goal, slip);
    }
    if (whole.compresses) {
      y_.n = 0;
      compression_ = y_.work;
    }
  }
  ImpactOutcome outcome() const {
    return {{y_.n, y_.t[0], y_.t[1]},
            {y_.p, y_.f[0], y_.f[1]},
            compression_,
            std::max(0.0, -y_.work),
            std::max(0.0, y_.rubbed)};
  }
  double work() const { return y_.work; }

 private:
  struct State {
    double n;                     ///< normal rate
    Across t;                     ///< slip
    double work = 0, rubbed = 0;  ///< of the normal force; lost to friction
    double p = 0;                 ///< normal impulse
    Across f{};                   ///< friction's
    State plus(double h, const State& d) const {
      return {n + h * d.n,       {t[0] + h * d.t[0], t[1] + h * d.t[1]},
              work + h * d.work, rubbed + h * d.rubbed,
              p + h * d.p,       {f[0] + h * d.f[0], f[1] + h * d.f[1]}};
    }
  };
  /// Per normal impulse, with the friction f per normal force.
  State change(const Across& f) const {
    State d{w_[0][0] + w_[0][1] * f[0] + w_[0][2] * f[1], {}};
    for (size_t i = 0; i < 2; ++i)
      d.t[i] = w_[i + 1][0] + w_[i + 1][1] * f[0] + w_[i + 1][2] * f[1];
    d.p = 1;
    d.f = f;
    return d;
  }
  /// With friction that keeps its direction, at most to the end of slip.
  /// @return whether at the goal
  bool straight(const Goal& goal, const Across& f, bool slips) {
    State d = change(f);
    if (!slips) d.t = {0, 0};  // but for rounding
    const double limit = goal.at(y_.n, d.n), slip = norm_of(y_.t);
    double p = limit;
    if (const double brake = along(d.t, y_.t); slip > 0 && brake < 0)
      p = std::min(p, -slip * slip / brake);
    const bool stops = p < limit;
    // Rates are linear in p, so their means are those at the middle.
    d.work = y_.n + 0.5 * p * d.n;
    d.rubbed = -along(f, {y_.t[0] + 0.5 * p * d.t[0], y_.t[1] + 0.5 * p * d.t[1]});
    y_ = y_.plus(p, d);
    if (stops) y_.t = {0, 0};
    return !stops;
  }
  State sliding(const State& y) const {
    const double slip = norm_of(y.t);
    const double k = slip > 0 ? -mu_ / slip : 0;
    State d = change({k * y.t[0], k * y.t[1]});
    d.work = y.n;
    d.rubbed = mu_ * slip;
    return d;
  }
  State runge_kutta(const State& y, double h) const {  // of order 4
    const State a = sliding(y), b = sliding(y.plus(0.5 * h, a)), c = sliding(y.plus(0.5 * h, b)),
                d = sliding(y.plus(h, c));
    return y.plus(h / 6, a).plus(h / 3, b).plus(h / 3, c).plus(h / 6, d);
  }
  /// A step of order 5 by extrapolation. @param error  of the slip, written
  State stepped(const State& y, double h, double& error) const {
    const State one = runge_kutta(y, h), two = runge_kutta(runge_kutta(y, 0.5 * h), 0.5 * h);
    error = norm_of({two.t[0] - one.t[0], two.t[1] - one.t[1]}) / 15;
    return two.plus(1.0 / 15, two).plus(-1.0 / 15, one);
  }
  /// With friction that turns with the slip, at most to its end. @return whether at the goal
  bool turning(const Goal& goal, double first) {
    const double before = y_.work;
    const auto beyond = [&](const State& y) { return goal.beyond(y.n, y.work - before); };
    double h = 0.1 * first / norm_of(sliding(y_).t), error = 0;
    for (double slip = first; slip > 1e-13 * first; slip = norm_of(y_.t)) {
      if (const double all = goal.at(y_.n, sliding(y_).n); all > 0)
        h = std::min(h, 1.01 * all);  // so that it ends beyond
      const State next = stepped(y_, h, error);
      const double allowed = 1e-12 * slip, factor = 0.8 * std::pow(allowed / error, 0.2);
      if (!(error <= allowed)) {
        h *= std::max(0.1, factor);
        continue;
      }
      if (beyond(next) < 0) {
        y_ = next;
        h *= std::min(2.0, factor);
        continue;
      }
      double low = 0, high = h;
      for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (beyond(stepped(y_, middle, error)) < 0 ? low : high) = middle;
      }
      y_ = stepped(y_, high, error);
      return true;
    }
    y_.t = {0, 0};
    return false;
  }

  const std::array<std::array<double, 3>, 3> w_;
  const double mu_;
  State y_;
  double compression_ = 0;
};

void require_range(bool holds, const char* what, double value, const char* expected) {
  if (!holds || !std::isfinite(value))
    throw InvalidArgument(fmt::format("{} is {:g}, expected {}", what, value, expected));
}

}  // namespace

SlipStart slip_start(const std::array<double, 3>& W, const std::array<double, 2>& a, double mu) {
  const auto solved = [&](double c) -> Across {  // (W + c)⁻¹ a, the least where W + c is singular
    const double xx = W[0] + c, yy = W[2] + c, det = xx * yy - W[1] * W[1], trace = xx + yy;
    if (det > 1e-14 * trace * trace)
      return {(yy * a[0] - W[1] * a[1]) / det, (xx * a[1] - W[1] * a[0]) / det};
    if (!(trace > 0)) return {0, 0};
    return {(xx * a[0] + W[1] * a[1]) / (trace * trace),
            (W[1] * a[0] + yy * a[1]) / (trace * trace)};
  };
  Across f = solved(0);
  if (norm_of(f) <= mu) return {{-f[0], -f[1]}, false};
  if (mu == 0) return {{0, 0}, true};
  // mu s = (W + c)⁻¹ a with |s| = 1: the length falls with c.
  double low = 0, high = norm_of(a) / mu;
  for (int k = 0; k < 200 && low < high; ++k) {
    const double c = 0.5 * (low + high);
    if (c == low || c == high) break;
    (norm_of(solved(c)) > mu ? low : high) = c;
  }
  f = solved(high);
  const double k = -mu / norm_of(f);
  return {{k * f[0], k * f[1]}, true};
}

ImpactOutcome impact_with_friction(const PointImpact& start, double e, double mu) {
  require_range(e >= 0 && e <= 1, "restitution", e, "0 to 1");
  require_range(mu >= 0, "friction", mu, "0 or more");
  const auto& W = start.W;
  require_range(W[0][0] > 0, "W along the normal", W[0][0], "more than 0");
  for (size_t i = 1; i < 3; ++i) {
    const double det = W[0][0] * W[i][i] - W[0][i] * W[0][i];
    require_range(det > 0 || W[i][i] == 0, "the determinant of W", det, "more than 0");
  }
  Progress impact(start, mu);
  if (start.u[0] < 0) {
    impact.reach({true});
    impact.reach({false, -e * e * impact.work()});
  }
  return impact.outcome();
}

}  // namespace porthos::contact
