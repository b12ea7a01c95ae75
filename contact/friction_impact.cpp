#include "contact/friction_impact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::contact {
namespace {

/// The impact in progress.
class Progress {
 public:
  Progress(const PlanarImpact& w, double mu) : w_(w), mu_(mu) {
    out_.normal = w.normal;
    out_.tangent = w.tangent;
  }

  /// The tangential force for a unit of normal force: against the slip, or what keeps the point
  /// sticking, or the limit in that direction.
  double friction() const {
    const double sticking = -w_.nt / w_.tt;
    if (out_.tangent == 0) return std::clamp(sticking, -mu_, mu_);
    return out_.tangent > 0 ? -mu_ : mu_;
  }
  /// Goes on by at most the normal impulse that `until` allows, at most to the end of slip.
  /// until(u_n, a_n): how far, for the rate u_n that changes by a_n per impulse.
  template <class Until>
  bool phase(const Until& until) {
    const double f = friction();
    const double an = w_.nn + w_.nt * f, at = w_.nt + w_.tt * f;
    const double limit = until(out_.normal, an);
    double p = limit;
    const bool slips = out_.tangent != 0;
    if (slips && out_.tangent * at < 0) p = std::min(p, -out_.tangent / at);
    const bool stops = slips && p < limit;
    const double mean = out_.normal + 0.5 * an * p,
                 slip = out_.tangent + (slips ? 0.5 * at * p : 0);
    work_ += mean * p;
    out_.friction_loss -= f * p * (slips ? slip : 0.5 * at * p);
    out_.impulse[0] += p;
    out_.impulse[1] += f * p;
    out_.normal += an * p;
    // A point that sticks keeps its rate: at is 0 but for rounding.
    const bool sticks = !slips && std::fabs(f) < mu_;
    out_.tangent = stops || sticks ? 0 : out_.tangent + at * p;
    return !stops;
  }
  void compress() {
    // Until the approach ends; where friction presses harder than the bodies yield, slip ends
    // first.
    while (!phase([](double u, double a) { return a > 0 ? -u / a : HUGE_VAL; }))
      ;
    out_.normal = 0;
    out_.compression = work_;
  }
  void restore(double e) {
    const double wanted = -e * e * work_;
    double given = 0;
    for (bool done = wanted <= 0; !done;) {
      const double left = wanted - given, before = work_;
      // u p + a p²/2 = left
      done = phase([left](double u, double a) {
        return 2 * left / (u + std::sqrt(std::max(u * u + 2 * a * left, 0.0)));
      });
      given += work_ - before;
    }
    out_.normal_loss = -work_;
  }
  const PlanarOutcome& outcome() const { return out_; }

 private:
  const PlanarImpact w_;
  const double mu_;
  PlanarOutcome out_;
  double work_ = 0;  ///< of the normal force
};

void require_range(bool holds, const char* what, double value, const char* expected) {
  if (!holds || !std::isfinite(value))
    throw InvalidArgument(fmt::format("{} is {:g}, expected {}", what, value, expected));
}

}  // namespace

PlanarOutcome impact_with_friction(const PlanarImpact& start, double e, double mu) {
  require_range(e >= 0 && e <= 1, "restitution", e, "0 to 1");
  require_range(mu >= 0, "friction", mu, "0 or more");
  const double det = start.nn * start.tt - start.nt * start.nt;
  require_range(start.nn > 0 && det > 0, "the determinant of W", det, "more than 0");
  Progress impact(start, mu);
  if (start.normal < 0) {
    impact.compress();
    impact.restore(e);
  }
  return impact.outcome();
}

}  // namespace porthos::contact
