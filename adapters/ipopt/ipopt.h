#pragma once
#include <string>

#include "planning/planner.h"

/// Plans by IPOPT (EPL), an interior-point method for programmes of any kind: an oracle for
/// planning::solve(), and something else to try where that stops.
namespace porthos::adapters {

struct IpoptOptions {
  /// Second derivatives of cost and steps; lbfgs: estimated from the first ones of six iterations.
  enum class Hessian { exact, lbfgs };
  Hessian hessian = Hessian::exact;
  /// IPOPT compares all derivatives of the guess with differences, and tells in `log` what it
  /// finds.
  bool check_derivatives = false;
  std::string log = {};  ///< a file that IPOPT writes its iterations to; empty: none
};

/// planning::solve() by IPOPT: the same equations with the steps' own derivatives, the same
/// conditions of an optimum in Plan::residual. IPOPT scales its tolerance otherwise, so what it
/// calls optimal may be a little above `options.tolerance` by ours. Of the options those of the
/// approach, any_extremal and exact_hessian are not used.
/// MUMPS, which solves IPOPT's linear equations, is for one thread of a program, and defines a few
/// functions of MPI: a program that uses MPI must not link this.
/// @throws InvalidArgument as planning::solve(); IoError for a log that cannot be written
planning::Plan solve_by_ipopt(const planning::Problem& problem, const planning::Trajectory& guess,
                              const planning::PlannerOptions& options = {},
                              const IpoptOptions& own = {});

/// Makes it known as "ipopt" to PlannerOptions::solver and to [plan] of scenes.
void add_ipopt();

}  // namespace porthos::adapters
