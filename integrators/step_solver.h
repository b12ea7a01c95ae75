#pragma once
#include <memory>
#include <string>

#include "integrators/newton.h"
#include "integrators/stagnation.h"

/// How the equations of an implicit step are solved. Shared by every implicit method.
namespace porthos::integrators {

/// The loop of an implicit step, by its parts:
///   guess(predicted)   puts the unknowns to their first values, with or without a prediction from the step before
///   sweep(distance)    one sweep; distance: how far the unknowns are from the start of the step, in the units of Sweep
///   between()          called before each further sweep
///   noise()            the largest move that may be rounding only, in the units of Sweep; 0 if not known
///   finish()           brings what the sweeps see up to what the last of them moved
template <class Guess, class SweepOnce, class Between, class Noise, class Finish>
struct Iteration {
  Guess guess;
  SweepOnce sweep;
  Between between;
  Noise noise;
  Finish finish;
};
template <class G, class S, class B, class N, class F>  // which Clang 14 does not deduce by itself
Iteration(G, S, B, N, F)->Iteration<G, S, B, N, F>;

struct Iterated {
  Outcome outcome = Outcome::not_converged;
  int sweeps = 0;
  bool ran_out = false;  ///< of sweeps, before stagnation; ok if only noise seemed left
  bool dropped = false;  ///< the prediction was further off than none at all, and dropped
};

/// Sweeps to stagnation, from a prediction where there is a good one.
template <class... Parts>
Iterated iterate(const Iteration<Parts...>& parts, Stagnation& stagnation, bool predicted,
                 int most_sweeps, int patience = 10) {
  Iterated r;
  parts.guess(predicted), stagnation.restart(patience);
  while (r.sweeps < most_sweeps) {
    ++r.sweeps;
    double distance;
    const Sweep p = parts.sweep(distance);
    if (r.sweeps == 1 && predicted && p.finite && p.change > distance) {
      r.dropped = true;
      parts.guess(false), stagnation.restart(patience);
      continue;
    }
    using enum Stagnation::Verdict;
    const auto verdict = stagnation.after(p);
    if (verdict == go_on && stagnation.wants_noise()) stagnation.set_noise(parts.noise());
    switch (verdict) {
      case not_finite:
        return r.outcome = Outcome::not_finite, r;
      case diverges:
        return r;
      case exact:
        return r.outcome = Outcome::ok, r;
      case stagnated:
        parts.finish();
        return r.outcome = Outcome::ok, r;
      case go_on:
        parts.between();
        break;
    }
  }
  r.ran_out = true;
  if (stagnation.settled()) parts.finish(), r.outcome = Outcome::ok;
  return r;
}

/// Solves steps by the fixed point while it contracts, else by Newton (see Solver). Of the equations it asks guess, sweep
/// and finish as above — a sweep by Newton where newton() says so — and
///   freeze(newton, solver)   freezes J where the unknowns are now
///   newton_step()            the step size J is frozen for
///   noise()                  of moves by Newton, as above, where it is offered
class StepSolver {
 public:
  StepSolver(Stagnation stagnation, const Options& o, size_t n)
      : stagnation_(stagnation), asked_(o.solver), most_sweeps_(o.max_sweeps), n_(n) {}

  /// Without, all is done by the fixed point.
  void set_newton(std::unique_ptr<SimplifiedNewton> newton) {
    if (!newton->solvers().empty()) newton_ = std::move(newton);
  }
  /// The Newton iteration at work, or null.
  SimplifiedNewton* newton() const {
    return solver_ == Solver::fixed_point ? nullptr : newton_.get();
  }

  template <class Equations>
  Outcome solve(Equations& e, bool have_prediction, Cost& cost);

  std::string remark(std::int64_t steps) const {
    if (!newton_ || choice_.newton_steps() == 0) return "";
    return std::string(to_string(newton_->solvers()[choice_.rung()])) + ", in " +
           std::to_string(choice_.newton_steps()) + " of " + std::to_string(steps) + " steps";
  }

  size_t memory_size() const {
    return 1 + (newton_ ? 1 + SolverChoice::memory_size + newton_->memory_size() : 0);
  }
  void save(std::vector<double>& m) const {
    m.push_back(distrust_);
    if (newton_) m.push_back(fresh_sweeps_), choice_.save(m), newton_->save(m);
  }
  void restore(std::span<const double> m) {
    distrust_ = whole(m[0]);
    if (!newton_) return;
    fresh_sweeps_ = whole(m[1]);
    choice_.restore(m.subspan(2)), newton_->restore(m.subspan(2 + SolverChoice::memory_size));
  }

 private:
  /// When a Newton iteration takes a new J. always: an iteration that contracts badly gets one at every sweep, and more
  /// patience — far from linear, Newton's method wanders before it converges.
  enum class Refresh { some, always };
  static constexpr int some_refreshes = 8;

  template <class Equations>
  Outcome iterate_by(Equations& e, bool predicted, Solver solver, int most_sweeps,
                     Refresh refresh = Refresh::some);
  template <class Equations>
  Outcome by_newton(Equations& e, bool predicted, Solver solver);
  /// What a factorisation costs, in sweeps, about.
  int worth_of_a_factorisation(Solver solver) const {
    return solver == Solver::newton_articulated ? 2
           : solver == Solver::newton_dense     ? 2 + int(n_) / 8
                                                : 0;
  }

  Stagnation stagnation_;
  Solver asked_;
  int most_sweeps_;
  size_t n_;
  std::unique_ptr<SimplifiedNewton> newton_;  ///< null: fixed point only
  SolverChoice choice_;
  Solver solver_ = Solver::fixed_point;  ///< at work
  int distrust_ = 0;                     ///< steps left without a prediction
  int sweeps_ = 0, fresh_sweeps_ = 0;    ///< of the last iteration, of the last with its own J
  bool ran_out_ = false;                 ///< so did the last iteration
  bool fresh_ = false;                   ///< J was frozen in this iteration
};

template <class Equations>
Outcome StepSolver::solve(Equations& e, bool have_prediction, Cost& cost) {
  const bool predicted = have_prediction && distrust_ == 0;
  if (distrust_ > 0) --distrust_;
  if (!newton_) return iterate_by(e, predicted, Solver::fixed_point, most_sweeps_);

  Outcome o = Outcome::not_converged;
  const bool free_choice = asked_ == Solver::automatic;
  bool all_tried = !free_choice;
  if (free_choice && !choice_.newton()) {
    const int limit =
        choice_.trial() ? std::min(SolverChoice::trial_sweeps, most_sweeps_) : most_sweeps_;
    o = iterate_by(e, predicted, Solver::fixed_point, limit);
    all_tried = limit == most_sweeps_ && !ran_out_;
    if (ran_out_) o = Outcome::not_converged;  // Newton goes further than "only noise seems left"
    choice_.fixed_point_was(o == Outcome::ok, sweeps_);
    if (o == Outcome::ok) return o;
  }
  const auto evaluations = newton_->evaluations(), factorisations = newton_->factorisations();
  for (size_t rung = choice_.rung(); rung < newton_->solvers().size(); ++rung) {
    o = by_newton(e, predicted && distrust_ == 0, newton_->solvers()[rung]);
    if (o != Outcome::ok) continue;
    choice_.newton_converged(rung);
    break;
  }
  if (o != Outcome::ok && free_choice) choice_.newton_failed();
  if (o != Outcome::ok && !all_tried) o = iterate_by(e, false, Solver::fixed_point, most_sweeps_);
  cost.evaluations += newton_->evaluations() - evaluations;
  cost.factorisations += newton_->factorisations() - factorisations;
  return o;
}

/// With the J of an earlier step if it still serves, else with its own, in the end with a new one at every sweep.
template <class Equations>
Outcome StepSolver::by_newton(Equations& e, bool predicted, Solver solver) {
  Outcome o = iterate_by(e, predicted, solver, most_sweeps_);
  if (o != Outcome::ok && !fresh_) {
    newton_->forget();
    o = iterate_by(e, predicted && distrust_ == 0, solver, most_sweeps_);
  }
  if (o != Outcome::ok && solver == newton_->solvers().back()) {
    newton_->forget();
    o = iterate_by(e, false, solver, most_sweeps_, Refresh::always);
  }
  const bool stale = !fresh_ && sweeps_ > fresh_sweeps_ + worth_of_a_factorisation(solver);
  if (o != Outcome::ok || stale)
    newton_->forget();
  else if (fresh_)
    fresh_sweeps_ = sweeps_;
  return o;
}

template <class Equations>
Outcome StepSolver::iterate_by(Equations& e, bool predicted, Solver solver, int most_sweeps,
                               Refresh refresh) {
  solver_ = solver, fresh_ = false;
  const bool newton = solver != Solver::fixed_point;
  int refreshed = 0;
  const auto freeze = [&] { e.freeze(*newton_, solver), fresh_ = true; };
  const auto guess = [&](bool with) {
    e.guess(with);
    // What was frozen at a prediction goes with it.
    if (newton && (fresh_ || !newton_->ready(solver, e.newton_step()))) freeze();
  };
  const auto sweep = [&](double& distance) { return e.sweep(distance); };
  const auto between = [&] {
    if (!newton || stagnation_.settled() || !(stagnation_.ratio() > 0.3)) return;
    if (refresh == Refresh::always || refreshed < some_refreshes) freeze(), ++refreshed;
  };
  const auto noise = [&]() -> double {
    if constexpr (requires { e.noise(); })
      return newton ? e.noise() : 0;
    else
      return 0;
  };
  const auto finish = [&] { e.finish(); };
  const Iteration parts{guess, sweep, between, noise, finish};
  const Iterated r = iterate(parts, stagnation_, predicted, most_sweeps,
                             refresh == Refresh::always ? most_sweeps : 10);
  if (r.dropped) distrust_ = 16;
  sweeps_ = r.sweeps, ran_out_ = r.ran_out;
  return r.outcome;
}

}  // namespace porthos::integrators
