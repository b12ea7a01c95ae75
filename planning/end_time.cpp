#include "planning/end_time.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace porthos::planning {
namespace {

constexpr double stride = 1.4;        // between durations before the optimum is enclosed
constexpr int most_strides = 30;      // a factor of 24 000
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
    Tried short_one, long_one = at(p_.duration);
    for (int i = 0; !long_one.solved() && i < most_strides && may_grow(long_one); ++i)
      long_one = at(longer(long_one));
    if (!long_one.solved()) return done(long_one);
    if (long_one.slope < 0) {
      for (int i = 0; long_one.slope < 0 && i < most_strides && may_grow(long_one); ++i) {
        short_one = long_one;
        long_one = at(longer(short_one));
        if (!long_one.solved()) return done(long_one);
      }
      if (long_one.slope < 0) return done(long_one);  // the longest that is allowed
    } else {
      short_one = long_one;
      for (int i = 0; short_one.slope >= 0 && i < most_strides && may_shrink(short_one); ++i) {
        long_one = short_one;
        short_one = at(std::max(free_.shortest, long_one.duration / stride));
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

  /// The plan of a duration, from the plan before or, where there is none, from the guess.
  Tried at(double duration) {
    p_.duration = duration;
    Tried t{duration};
    PlannerOptions o = o_;
    if (last_) o.approach = false;
    try {
      t.plan = solve(p_, last_ ? *last_ : guess_, o);
    } catch (const InvalidArgument&) {  // its first steps have no solution
      t.plan.motion = last_ ? *last_ : guess_;
    }
    iterations_ += t.plan.iterations;
    evaluations_ += t.plan.evaluations;
    if (!t.solved()) return t;
    last_ = t.plan.motion;
    t.slope = t.plan.duration_slope + free_.weight;
    return t;
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
      const Tried t = at(middle);
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
  std::optional<Trajectory> last_;  ///< of the last plan that was found
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
