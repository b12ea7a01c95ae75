#pragma once
#include <memory>
#include <string>

#include "integrators/core/stagnation.h"
#include "integrators/implicit/newton.h"

/// The solution of an implicit step's equations. Shared by all implicit methods.
namespace porthos::integrators {

/// The parts of the loop of an implicit step:
///   guess(predicted)   sets the unknowns to first values, with or without a prediction from the
///                      step before
///   sweep(distance)    one sweep; distance: of the unknowns from the start of the step, in the
///                      units of Sweep
///   between()          called before each further sweep
///   noise()            the largest move that may be rounding only, in the units of Sweep; 0 if not
///                      known
///   finish()           updates what the sweeps read after the last of them
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

/// The state of an iteration between its sweeps: the one state machine of all implicit methods, for
/// one state or one lane.
class Iterating {
 public:
  /// The action after a sweep.
  enum class Next {
    sweep,
    guess_again,  ///< the prediction was worse than none: start without it
    finish,       ///< no further progress: finish(), then done
    done,         ///< a fixed point
    diverges,
    not_finite
  };
  explicit Iterating(Stagnation stagnation) : stagnation_(stagnation) {}

  void begin(bool predicted, int most_sweeps, int patience = 10) {
    predicted_ = predicted;
    most_ = most_sweeps;
    patience_ = patience;
    sweeps_ = 0;
    dropped_ = false;
    stagnation_.restart(patience);
  }
  /// distance, noise: as in Iteration
  template <class Noise>
  Next after(const Sweep& s, double distance, const Noise& noise) {
    using enum Stagnation::Verdict;
    if (++sweeps_ == 1 && predicted_ && s.finite && s.change > distance) {
      dropped_ = true;
      stagnation_.restart(patience_);
      return Next::guess_again;
    }
    const auto verdict = stagnation_.after(s);
    if (verdict == go_on && stagnation_.wants_noise()) stagnation_.set_noise(noise());
    return verdict == go_on       ? Next::sweep
           : verdict == exact     ? Next::done
           : verdict == stagnated ? Next::finish
           : verdict == diverges  ? Next::diverges
                                  : Next::not_finite;
  }
  /// Whether the sweeps are used up. The result is good enough if only noise seems to remain.
  bool ran_out() const { return sweeps_ >= most_; }
  bool settled() const { return stagnation_.settled(); }

  int sweeps() const { return sweeps_; }
  bool dropped() const { return dropped_; }  ///< so the prediction was dropped
  const Stagnation& stagnation() const { return stagnation_; }

 private:
  Stagnation stagnation_;
  int most_ = 0, patience_ = 10, sweeps_ = 0;
  bool predicted_ = false, dropped_ = false;
};

/// How an iteration ended.
struct Iterated {
  Outcome outcome = Outcome::not_converged;
  bool ran_out = false;  ///< of sweeps, before stagnation; ok if only noise seems to remain
};

/// Sweeps to stagnation, from a prediction if there is a good one.
template <class... Parts>
Iterated iterate(const Iteration<Parts...>& parts, Iterating& iteration, bool predicted,
                 int most_sweeps, int patience = 10) {
  parts.guess(predicted);
  iteration.begin(predicted, most_sweeps, patience);
  while (!iteration.ran_out()) {
    double distance;
    const Sweep s = parts.sweep(distance);
    switch (iteration.after(s, distance, parts.noise)) {
      case Iterating::Next::sweep:
        parts.between();
        break;
      case Iterating::Next::guess_again:
        parts.guess(false);
        break;
      case Iterating::Next::finish:
        parts.finish();
        return {Outcome::ok};
      case Iterating::Next::done:
        return {Outcome::ok};
      case Iterating::Next::diverges:
        return {Outcome::not_converged};
      case Iterating::Next::not_finite:
        return {Outcome::not_finite};
    }
  }
  if (!iteration.settled()) return {Outcome::not_converged, true};
  parts.finish();
  return {Outcome::ok, true};
}

/// What the solver keeps from step to step.
struct SolverMemory {
  int distrust = 0;      ///< steps left without a prediction
  int fresh_sweeps = 0;  ///< of the last iteration that froze its own J
  SolverChoice choice;

  /// For the next step: whether it starts from the prediction.
  bool trusts(bool have_prediction) {
    if (distrust == 0) return have_prediction;
    --distrust;
    return false;
  }
  void dropped_prediction() { distrust = 16; }
};

/// Solves steps by fixed-point iteration while it contracts, else by Newton (see Solver). Of the
/// equations it requires guess, sweep and finish as above, where a sweep is one of Newton if
/// newton() is not null, and
///   freeze(newton, solver)   freezes J at the current unknowns
///   newton_step()            the step size for which J is frozen
///   noise()                  of Newton's moves, as above; optional
class StepSolver {
 public:
  StepSolver(Stagnation stagnation, const Options& o, size_t n)
      : iteration_(stagnation), asked_(o.solver), most_sweeps_(o.max_sweeps), n_(n) {}

  /// Without it, everything is solved by fixed-point iteration.
  void set_newton(std::unique_ptr<SimplifiedNewton> newton) {
    if (!newton->solvers().empty()) newton_ = std::move(newton);
  }
  bool has_newton() const { return newton_ != nullptr; }
  /// The Newton iteration in use, or null.
  SimplifiedNewton* newton() const {
    return solver_ == Solver::fixed_point ? nullptr : newton_.get();
  }

  template <class Equations>
  Outcome solve(Equations& e, bool have_prediction, Cost& cost);

  /// Which solver of Newton it has, and how often; empty: never.
  std::string remark() const {
    if (!newton_ || memory_.choice.newton_steps() == 0) return "";
    return std::string(to_string(newton_->solvers()[memory_.choice.rung()])) + ", in " +
           std::to_string(memory_.choice.newton_steps()) + " of " +
           std::to_string(memory_.choice.solutions()) + " solutions";
  }

  void carry(Archive& a) { carry(a, memory_); }
  /// With the memory of a lane instead.
  void carry(Archive& a, SolverMemory& memory) {
    a(memory.distrust);
    if (!newton_) return;
    a(memory.fresh_sweeps);
    memory.choice.carry(a);
    newton_->carry(a);
  }

 private:
  /// When a Newton iteration computes a new J. always: an iteration that contracts badly computes
  /// one at every sweep and gets more patience, because on strongly nonlinear equations
  /// Newton's method wanders before it converges.
  enum class Refresh { some, always };
  static constexpr int some_refreshes = 8;

  template <class Equations>
  Outcome iterate_by(Equations& e, bool predicted, Solver solver, int most_sweeps,
                     Refresh refresh = Refresh::some);
  template <class Equations>
  Outcome by_newton(Equations& e, bool predicted, Solver solver);
  /// The approximate cost of a factorisation, in sweeps.
  int worth_of_a_factorisation(Solver solver) const {
    return solver == Solver::newton_articulated ? 2
           : solver == Solver::newton_dense     ? 2 + int(n_) / 8
                                                : 0;
  }

  Iterating iteration_;
  Solver asked_;
  int most_sweeps_;
  size_t n_;
  std::unique_ptr<SimplifiedNewton> newton_;  ///< null: fixed point only
  SolverMemory memory_;
  Solver solver_ = Solver::fixed_point;  ///< in use
  bool ran_out_ = false;                 ///< the last iteration ran out of sweeps
  bool fresh_ = false;                   ///< J was frozen in this iteration
};

template <class Equations>
Outcome StepSolver::solve(Equations& e, bool have_prediction, Cost& cost) {
  const bool predicted = memory_.trusts(have_prediction);
  if (!newton_) return iterate_by(e, predicted, Solver::fixed_point, most_sweeps_);

  Outcome o = Outcome::not_converged;
  const bool free_choice = asked_ == Solver::automatic;
  bool all_tried = !free_choice;
  if (free_choice && !memory_.choice.newton()) {
    const int limit =
        memory_.choice.trial() ? std::min(SolverChoice::trial_sweeps, most_sweeps_) : most_sweeps_;
    o = iterate_by(e, predicted, Solver::fixed_point, limit);
    all_tried = limit == most_sweeps_ && !ran_out_;
    if (ran_out_) o = Outcome::not_converged;  // Newton gets closer than "only noise"
    memory_.choice.fixed_point_was(o == Outcome::ok, iteration_.sweeps());
    if (o == Outcome::ok) return o;
  }
  const auto evaluations = newton_->evaluations(), factorisations = newton_->factorisations();
  for (size_t rung = memory_.choice.rung(); rung < newton_->solvers().size(); ++rung) {
    o = by_newton(e, predicted && memory_.distrust == 0, newton_->solvers()[rung]);
    if (o != Outcome::ok) continue;
    memory_.choice.newton_converged(rung);
    break;
  }
  if (o != Outcome::ok && free_choice) memory_.choice.newton_failed();
  if (o != Outcome::ok && !all_tried) o = iterate_by(e, false, Solver::fixed_point, most_sweeps_);
  cost.evaluations += newton_->evaluations() - evaluations;
  cost.factorisations += newton_->factorisations() - factorisations;
  return o;
}

/// First with the J of an earlier step if it is still useful, then with its own J, finally with a
/// new one at every sweep.
template <class Equations>
Outcome StepSolver::by_newton(Equations& e, bool predicted, Solver solver) {
  Outcome o = iterate_by(e, predicted, solver, most_sweeps_);
  if (o != Outcome::ok && !fresh_) {
    newton_->forget();
    o = iterate_by(e, predicted && memory_.distrust == 0, solver, most_sweeps_);
  }
  if (o != Outcome::ok && solver == newton_->solvers().back()) {
    newton_->forget();
    o = iterate_by(e, false, solver, most_sweeps_, Refresh::always);
  }
  const bool stale =
      !fresh_ && iteration_.sweeps() > memory_.fresh_sweeps + worth_of_a_factorisation(solver);
  if (o != Outcome::ok || stale)
    newton_->forget();
  else if (fresh_)
    memory_.fresh_sweeps = iteration_.sweeps();
  return o;
}

template <class Equations>
Outcome StepSolver::iterate_by(Equations& e, bool predicted, Solver solver, int most_sweeps,
                               Refresh refresh) {
  solver_ = solver;
  fresh_ = false;
  const bool newton = solver != Solver::fixed_point;
  int refreshed = 0;
  const auto freeze = [&] {
    e.freeze(*newton_, solver);
    fresh_ = true;
  };
  const auto guess = [&](bool with) {
    e.guess(with);
    // A J frozen at a prediction is dropped with that prediction.
    if (newton && (fresh_ || !newton_->ready(solver, e.newton_step()))) freeze();
  };
  const auto sweep = [&](double& distance) { return e.sweep(distance); };
  const auto between = [&] {
    if (!newton || iteration_.settled() || !(iteration_.stagnation().ratio() > 0.3)) return;
    if (refresh == Refresh::always || refreshed < some_refreshes) {
      freeze();
      ++refreshed;
    }
  };
  const auto noise = [&]() -> double {
    if constexpr (requires { e.noise(); })
      return newton ? e.noise() : 0;
    else
      return 0;
  };
  const auto finish = [&] { e.finish(); };
  const Iteration parts{guess, sweep, between, noise, finish};
  const Iterated r = iterate(parts, iteration_, predicted, most_sweeps,
                             refresh == Refresh::always ? most_sweeps : 10);
  if (iteration_.dropped()) memory_.dropped_prediction();
  ran_out_ = r.ran_out;
  return r.outcome;
}

}  // namespace porthos::integrators
