#include "planning/planner.h"

#include <fmt/format.h>

#include <map>

#include "planning/detail/approach.h"
#include "planning/detail/newton_iteration.h"

namespace porthos::planning {
namespace detail {

/// A full Newton step for the last digits, at the last barrier. @return whether the residual halved
bool NewtonIteration::polish(Plan& plan) {
  const Point before = at_;
  const double was = residuals(barrier_).largest();
  Move move;
  if (!step(move, true)) return false;
  const double dual = std::min(room_of(at_.lower, move.lower), room_of(at_.upper, move.upper));
  ++evaluations_;
  if (room(at_.c, move.c) == 1 && shooting_.evaluate(at_.v + move.v)) {
    take(move, 1, dual, before.v + move.v);
    shooting_.differentiate();
    ++plan.iterations;
    if (residuals(barrier_).largest() < 0.5 * was) return true;
  }
  at_ = before;
  (void)shooting_.evaluate(at_.v);
  shooting_.differentiate();
  return false;
}

/// The longest of the halved steps that lessens the residual.
bool NewtonIteration::search_extremal(const Move& move) {
  const Point before = at_;
  const double was = residuals(0).largest();
  for (double alpha = 1; alpha > 1e-6; alpha *= 0.5) {
    ++evaluations_;
    at_ = before;
    if (!shooting_.evaluate(at_.v + alpha * move.v)) continue;
    take(move, alpha, alpha, before.v + alpha * move.v);
    shooting_.differentiate();
    if (residuals(0).largest() < (1 - 0.1 * alpha) * was) return true;
  }
  at_ = before;
  return false;
}

void NewtonIteration::finish(Plan& plan) {
  const Residuals r = residuals(0);
  plan.residual = r.largest();
  plan.defect = r.defect;
  plan.stationarity = r.stationarity;
  plan.complementarity = r.complementarity;
  plan.cost = shooting_.cost;
  plan.evaluations = evaluations_;
  const auto list = [](const auto& part) { return std::vector<double>(part.begin(), part.end()); };
  plan.motion.x = list(at_.v.head(shooting_.at_w(0)));
  plan.motion.u = list(at_.v.tail(shooting_.N() * shooting_.nw()));
  const Vector pull = at_.upper - at_.lower;
  plan.duration_slope = shooting_.by_duration(at_.lambda, of_path(pull));
  at_.lambda.head(shooting_.nx()) = shooting_.at_start(at_.lambda);
  plan.costates = list(at_.lambda);
  plan.goal_multipliers = list(at_.nu);
  for (const long i : limited_) {
    const auto touches = [&](double limit) {
      return std::fabs(at_.c[i] - limit) < 1e-6 * (1 + std::fabs(limit));
    };
    plan.active_limits += touches(low_[i]) || touches(high_[i]);
  }
}

Plan NewtonIteration::judge(const Vector& v, const Vector& lambda, const Vector& nu,
                            const Vector& lower, const Vector& upper) {
  Plan plan;
  at_.v = v;
  if (!shooting_.evaluate(v)) throw InvalidArgument("a step of what is judged has no solution");
  shooting_.differentiate();
  at_.lambda.tail(lambda.size()) = lambda;
  at_.nu = nu;
  at_.c = joined(v, path());
  at_.lower = at_.upper = Vector::Zero(at_.c.size());
  for (const long i : limited_) {
    if (std::isfinite(low_[i])) at_.lower[i] = lower[i];
    if (std::isfinite(high_[i])) at_.upper[i] = upper[i];
  }
  finish(plan);
  return plan;
}

Plan NewtonIteration::run() {
  Plan plan;
  if (o_.approach) {
    plan.approach = approach(shooting_, at_.v, o_);
    if (plan.approach < 0)
      throw InvalidArgument(
          "a step with the inputs of the guess has no solution, expected smaller "
          "inputs or more intervals");
    move_inside(at_.v);
  }
  if (!begin())
    throw InvalidArgument(
        "a step of the first guess has no solution, expected a gentler guess or more intervals");
  for (;; ++plan.iterations) {
    shooting_.differentiate();
    if (plan.iterations == 0) estimate_multipliers();
    const Residuals r = residuals(0);
    nearly_stationary_ = r.defect < 1e-4 && r.stationarity < 1e-3;
    plan.history.push_back({shooting_.cost, r.defect, r.stationarity, last_step_, regularisation_});
    if (r.largest() <= o_.tolerance) {
      plan.status = Plan::Status::optimal;
      break;
    }
    plan.status = Plan::Status::too_many_iterations;
    if (plan.iterations >= o_.iterations) break;
    plan.status = Plan::Status::stopped;
    if (o_.stop && o_.stop->load(std::memory_order_relaxed)) break;
    if (plan.iterations > 0) lower_barrier();
    Move move;
    plan.status = Plan::Status::no_progress;
    if (!step(move, o_.exact_hessian)) break;
    if (o_.any_extremal ? !search_extremal(move) : !search(move) && !search_afresh(move)) {
      if (sweep_.unreached > 0) plan.status = Plan::Status::unreachable;
      (void)shooting_.evaluate(at_.v);
      shooting_.differentiate();
      break;
    }
  }
  if (plan.status == Plan::Status::optimal && o_.exact_hessian)
    while (plan.iterations < o_.iterations && polish(plan)) {
    }
  finish(plan);
  return plan;
}

}  // namespace detail

const char* to_string(Plan::Status status) {
  switch (status) {
    case Plan::Status::optimal:
      return "optimal";
    case Plan::Status::no_progress:
      return "no progress";
    case Plan::Status::too_many_iterations:
      return "too many iterations";
    case Plan::Status::unreachable:
      return "unreachable";
    case Plan::Status::stopped:
      return "stopped";
  }
  return "";
}

namespace {

std::map<std::string, Solver>& known_solvers() {
  static std::map<std::string, Solver> list;
  return list;
}

}  // namespace

void add_solver(const std::string& name, Solver solver) { known_solvers()[name] = solver; }

Solver find_solver(const std::string& name) {
  const auto& list = known_solvers();
  const auto found = list.find(name);
  return found == list.end() ? nullptr : found->second;
}

Plan solve(const Problem& problem, const Trajectory& guess, const PlannerOptions& options) {
  if (!options.solver.empty()) {
    const Solver other = find_solver(options.solver);
    if (!other)
      throw InvalidArgument(fmt::format(
          "solver is '{}', which this program does not have, expected '' or one of add_solver()",
          options.solver));
    return other(problem, guess, options);
  }
  check_guess(problem, guess);
  const Limits& l = problem.limits;
  if (options.any_extremal &&
      !(l.input_lower.empty() && l.input_upper.empty() && l.state_lower.empty() &&
        l.state_upper.empty() && l.rate.empty() && l.path.empty()))
    throw InvalidArgument("any_extremal takes no limits, expected a problem without");
  Plan plan = detail::NewtonIteration(problem, guess, options).run();
  const auto ended = [](const Plan& p) {
    return p.status == Plan::Status::optimal || p.status == Plan::Status::stopped;
  };
  if (ended(plan) || options.any_extremal) return plan;
  int spent = plan.iterations;
  const auto better = [&](Plan again) {
    again.iterations += spent;
    return again;
  };
  if (!l.path.empty()) {  // from the optimum without the limits on the way
    Problem without = problem;
    without.limits.path.clear();
    const Plan first = detail::NewtonIteration(without, guess, options).run();
    spent += first.iterations;
    if (first.status == Plan::Status::optimal) {
      const Plan again = detail::NewtonIteration(problem, first.motion, options).run();
      if (ended(again)) return better(again);
      spent += again.iterations;
    }
  }
  const Plan careful = detail::NewtonIteration(problem, guess, options, true).run();
  return ended(careful) ? better(careful) : plan;
}

}  // namespace porthos::planning
