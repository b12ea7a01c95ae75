#include "planning/end_time.h"

#include <fmt/format.h>

#include <cmath>

namespace porthos::planning {
namespace {

constexpr double stride = 1.4;        // between durations before the optimum is enclosed
constexpr int most_strides = 30;      // a factor of 24 000
constexpr int most_halvings = 4;      // of a stride
constexpr int most_refinements = 60;  // of the enclosure
constexpr double close = 1e-9;        // of the slope, as a share of the weight
constexpr double narrow = 1e-9;       // of the enclosure, as a share of the duration

/// A duration with its plan. Where there is none, the duration is too short.
struct Tried {
  double duration = 0;
  Plan plan = {};
  double slope = -HUGE_VAL;  ///< of cost + weight · duration
  bool solved() const { return plan.status == Plan::Status::optimal; }
};

class EndTimeSearch {
 public:
  EndTimeSearch(Problem& p, const Trajectory& guess, const EndTime& free, const PlannerOptions& o)
      : p_(p), guess_(guess), free_(free), o_(o) {}

  Plan run() {
    Tried short_one, long_one = at(p_.duration, guess_, o_.approach);
    for (int i = 0; !long_one.solved() && i < most_strides && may_grow(long_one); ++i)
      long_one = follow(long_one, longer(long_one));
    if (!long_one.solved()) return done(long_one);
    if (long_one.slope < 0) {
      for (int i = 0; long_one.slope < 0 && i < most_strides && may_grow(long_one); ++i) {
        short_one = long_one;
        long_one = follow(short_one, longer(short_one));
        if (!long_one.solved()) return done(long_one);
      }
      if (long_one.slope < 0) return done(long_one);  // the longest that is allowed
    } else {
      short_one = long_one;
      for (int i = 0; short_one.slope >= 0 && i < most_strides && may_shrink(short_one); ++i) {
        long_one = short_one;
        short_one = follow(long_one, std::max(free_.shortest, long_one.duration / stride));
      }
      if (short_one.slope >= 0) return done(short_one);
    }
    return refine(short_one, long_one);
  }

 private:
  bool stopped() const { return o_.stop && o_.stop->load(std::memory_order_relaxed); }
  bool may_grow(const Tried& t) const { return !stopped() && t.duration < free_.longest; }
  bool may_shrink(const Tried& t) const { return !stopped() && t.duration > free_.shortest; }
  double longer(const Tried& t) const { return std::min(free_.longest, t.duration * stride); }

  /// The plan of a duration, from a guess.
  Tried at(double duration, const Trajectory& guess, bool approach = false) {
    p_.duration = duration;
    Tried t{duration};
    PlannerOptions o = o_;
    o.approach = approach;
    try {
      t.plan = solve(p_, guess, o);
    } catch (const InvalidArgument&) {  // its first steps have no solution
      t.plan.motion = guess;
    }
    iterations_ += t.plan.iterations;
    evaluations_ += t.plan.evaluations;
    if (t.solved()) t.slope = t.plan.duration_slope + free_.weight;
    return t;
  }
  /// The same from the plan of another duration, in smaller strides where the solver leaves the
  /// family of optima: there the cost changes by the integral of its slope.
  Tried follow(const Tried& from, double duration, int halvings = most_halvings) {
    if (!from.solved()) return at(duration, guess_, o_.approach);
    const Tried t = at(duration, from.plan.motion);
    const double change =
        0.5 * (from.plan.duration_slope + t.plan.duration_slope) * (duration - from.duration);
    if (halvings == 0 || stopped() ||
        (t.solved() && std::fabs(t.plan.cost - from.plan.cost - change) <= 0.2 * std::fabs(change)))
      return t;
    const Tried middle = follow(from, 0.5 * (from.duration + duration), halvings - 1);
    return middle.solved() ? follow(middle, duration, halvings - 1) : t;
  }

  /// The zero of the slope between a duration that is too short and one that is too long.
  Plan refine(Tried a, Tried b) {
    double slope_a = a.slope, slope_b = b.slope;
    int side = 0;  // of the last replacement
    for (int i = 0; i < most_refinements && !stopped(); ++i) {
      if (b.duration - a.duration <= narrow * b.duration) break;
      const double middle = std::isfinite(slope_a) ? (a.duration * slope_b - b.duration * slope_a) /
                                                         (slope_b - slope_a)
                                                   : 0.5 * (a.duration + b.duration);
      const bool from_a = a.solved() && middle - a.duration < b.duration - middle;
      const Tried t = follow(from_a ? a : b, middle);
      if (std::fabs(t.slope) <= close * free_.weight) return done(t);
      const int now = t.slope < 0 ? -1 : 1;
      (now < 0 ? a : b) = t;
      (now < 0 ? slope_a : slope_b) = t.slope;
      if (now == side) (now < 0 ? slope_b : slope_a) *= 0.5;  // an end that stays pulls less
      side = now;
    }
    return done(b);
  }

  /// The plan of a duration, which becomes the problem's.
  Plan done(const Tried& t) {
    p_.duration = t.duration;
    Plan plan = t.plan;
    if (stopped()) plan.status = Plan::Status::stopped;
    plan.cost += free_.weight * t.duration;
    plan.iterations = iterations_;
    plan.evaluations = evaluations_;
    return plan;
  }

  Problem& p_;
  const Trajectory& guess_;
  const EndTime& free_;
  const PlannerOptions& o_;
  int iterations_ = 0, evaluations_ = 0;
};

}  // namespace

Plan solve_end_time(Problem& problem, const Trajectory& guess, const EndTime& free,
                    const PlannerOptions& options) {
  if (!(free.weight > 0 && std::isfinite(free.weight)))
    throw InvalidArgument(
        fmt::format("the weight of the duration is {}, expected a positive number", free.weight));
  if (!(free.shortest <= problem.duration && problem.duration <= free.longest))
    throw InvalidArgument(
        fmt::format("the duration {} s is outside of its limits {} and {} s, expected one between",
                    problem.duration, free.shortest, free.longest));
  problem.check();
  return EndTimeSearch(problem, guess, free, options).run();
}

}  // namespace porthos::planning
