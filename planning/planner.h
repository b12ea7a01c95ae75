#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "planning/problem.h"

namespace porthos::planning {

/// How the solver works.
struct PlannerOptions {
  int iterations = 200;     ///< at most, of each attempt
  double tolerance = 1e-9;  ///< of the residual, see Plan::residual
  /// false: without the second derivatives of f. A step costs less, and there are more of them.
  bool exact_hessian = true;
  /// First approaches the goals by motions that lessen the cost and their distance: more iterations
  /// of less risk, for goals that are far from the guess. Only the inputs of the guess are used.
  bool approach = false;
  /// true: any stationary point near the guess, also one that is no minimum, by plain Newton steps
  /// that lessen the residual. Without limits only.
  bool any_extremal = false;
  double first_barrier = 0.1;               ///< with limits: the first weight of their logarithms
  const std::atomic<bool>* stop = nullptr;  ///< true: give up
  std::string solver = {};                  ///< of add_solver(), instead of Newton's method here
};

/// A solution, or where the solver stopped.
struct Plan {
  enum class Status { optimal, no_progress, too_many_iterations, unreachable, stopped };
  Status status = Status::no_progress;
  Trajectory motion;
  double cost = 0;
  /// λ at the ends of the intervals, (intervals + 1) · nx: the derivative of the cost by the state
  /// there; λ_0 by the start. Of order 2s for inputs at the stages.
  std::vector<double> costates;
  /// The derivative of the least cost by the duration, if the dynamics do not depend on the time
  /// and the goals at the end neither.
  double duration_slope = 0;
  std::vector<double> goal_multipliers;  ///< of each goal: minus the derivative of the cost by its
                                         ///< value
  /// Largest violation of the conditions of an optimum: of its equations (the steps and the goals),
  /// of stationarity and of complementarity; the last two relative to 1 + the largest multiplier.
  double residual = 0, defect = 0, stationarity = 0, complementarity = 0;
  int approach = 0;       ///< iterations of the approach
  int iterations = 0;     ///< of Newton's method
  int evaluations = 0;    ///< of all intervals, without derivatives
  int active_limits = 0;  ///< limits that a number touches, within 1e-6 of their size
  /// One line for each iteration.
  struct Line {
    double cost, defect, stationarity, step, regularisation;
  };
  std::vector<Line> history;
};
const char* to_string(Plan::Status status);

/// Solves an optimal control problem by Newton's method on its optimality conditions (sequential
/// quadratic programming over multiple shooting). Each step is one Riccati sweep. Limits are kept
/// by a primal-dual interior point; a filter decides about steps (Wächter, Biegler 2006, Math.
/// Program. 106). Without limits the last steps converge quadratically. Where it makes no progress
/// it begins again at the optimum without Limits::path, and
/// then at the guess with shorter steps that keep the second derivatives of f.
/// @param guess  states and inputs to begin with; they need not fit together, but its x_0 is the
///   start
/// @throws InvalidArgument as Problem::check(); for limits with any_extremal; for a guess of the
///   wrong size; if the first steps cannot be evaluated; for a solver that is not known
Plan solve(const Problem& problem, const Trajectory& guess, const PlannerOptions& options = {});

/// Another solver of the same problems, such as that of adapters/ipopt.
using Solver = Plan (*)(const Problem&, const Trajectory&, const PlannerOptions&);
/// Makes a solver known to solve() as PlannerOptions::solver = name; it replaces one of that name.
/// Call it while no other thread plans.
void add_solver(const std::string& name, Solver solver);
/// The one of that name, or null.
Solver find_solver(const std::string& name);

}  // namespace porthos::planning
