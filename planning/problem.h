#pragma once
#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "phs/functions/function.h"
#include "planning/dynamics.h"
#include "planning/path_number.h"

/// Optimal control by direct transcription on Gauss's methods: the plan is a run of the method.
namespace porthos::planning {

/// The running cost l(x, u) = Σ input_a u_a² + Σ rate_k f_k(x, u)² + Σ drawn power. Its integral
/// is taken with the weights of the method.
struct RunningCost {
  std::vector<double> input;  ///< weight of each input, size nu; empty: 0
  std::vector<double> rate;   ///< weight of each component of x' = f, size nx; empty: 0
  /// The power that an input draws, P = u f_k, as ½ weight (P + √(P² + smoothing²)): what flows
  /// back is lost.
  struct Drawn {
    int input = 0, rate = 0;  ///< offsets in u and in f
    double weight = 0;
    double smoothing = 0;  ///< > 0 [W]
  };
  std::vector<Drawn> drawn;
};

/// One number that the end of the plan must have.
struct Goal {
  std::vector<std::pair<int, double>> row;  ///< Σ factor · x_k = value
  int rate = -1;                            ///< instead: f_rate(x, u = 0) = value
  double value = 0;
  /// Instead: c(duration, x) = value. Used by one solver at a time.
  std::shared_ptr<PathNumber> number = {};
};

/// An attitude as three goals, 2 Im(ḡ ξ) = 0, for the quaternion ξ (w, x, y, z) at `at` in x and
/// the unit quaternion g. Gauss's methods keep |ξ|, so there is no fourth.
std::vector<Goal> attitude_goals(int at, const std::array<double, 4>& g);

/// Limits; -inf and inf where there is none. Empty: no limits.
struct Limits {
  std::vector<double> input_lower, input_upper;  ///< of u, size nu
  /// Of x, size nx. They hold at the ends of the intervals, for the last one where no goal fixes
  /// that number; not at the start.
  std::vector<double> state_lower, state_upper;
  /// Of |x'_k|, size nx, more than 0: they hold at the stages of all intervals.
  std::vector<double> rate = {};
  /// Of numbers of the state, at the same places.
  std::vector<PathLimit> path = {};
};
inline constexpr double no_limit = std::numeric_limits<double>::infinity();

/// How inputs vary in an interval.
enum class Inputs {
  held,      ///< constant
  at_stages  ///< one value at each stage of the method: a polynomial of degree s - 1. The cost and
             ///< the costates then have the method's order 2s
};

/// Find u that takes x' = f(t, x, u) from `start` to the goals at least cost. Each interval is one
/// step of Gauss's method.
struct Problem {
  std::shared_ptr<Dynamics> dynamics;  ///< used by one solver at a time
  int stages = 2;                      ///< of the method, 1 to 8; its order is twice that
  double duration = 1;                 ///< [s]
  int intervals = 50;
  Inputs inputs = Inputs::held;
  std::vector<double> start;  ///< size nx, angles unwrapped
  RunningCost cost;
  std::vector<Goal> goals;
  Limits limits;

  double step() const { return duration / intervals; }
  /// Inputs of one interval: nu, or stages · nu.
  int per_interval() const { return dynamics->nu() * (inputs == Inputs::held ? 1 : stages); }
  /// @throws InvalidArgument naming what does not fit
  void check() const;
};

/// States at the ends of the intervals and the inputs between them.
struct Trajectory {
  std::vector<double> x;  ///< (intervals + 1) · nx
  std::vector<double> u;  ///< intervals · per_interval(), stage after stage
};

/// @throws InvalidArgument as Problem::check(); for a guess of the wrong size
void check_guess(const Problem& problem, const Trajectory& guess);
/// A straight line from the start to `end`, with inputs 0. @param end  size nx
Trajectory straight(const Problem& problem, const std::vector<double>& end);
/// The motion that the inputs of `t` cause from the start: its states are replaced.
/// @throws InvalidArgument if a step does not converge
void follow_inputs(const Problem& problem, Trajectory& t);

/// Input number `input` of a trajectory as a function of time: the same numbers at the stages, so a
/// run of the method with steps of one interval repeats the plan.
phs::FunctionPtr input_signal(const Problem& problem, const Trajectory& t, int input);
/// A trajectory on the intervals, stages or kind of inputs of another problem of the same duration:
/// the values of its polynomials. Inputs that become held have their value at the middle.
Trajectory resample(const Problem& from, const Trajectory& t, const Problem& to);

}  // namespace porthos::planning
