#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/implicit/resolvents.h"

/// Simplified Newton iteration of implicit Runge-Kutta-like methods, and the rule for its use.
namespace porthos::integrators {

/// r ← (I - h A ⊗ J)⁻¹ r for a method's s × s matrix A, J ≈ Df frozen at one point.
///
/// A is diagonalised once, so the s·nx equations decouple into complex ones of size nx: one for
/// each conjugate pair and one for each real eigenvalue. They are solved side by side as lanes
/// (Hairer, Wanner 1996, IV.8). J does not affect the limit of the iteration, which the given
/// residual determines.
class SimplifiedNewton {
 public:
  /// A row-major. field: the map whose Jacobian the dense and the Krylov solver use; null: the
  /// model's field. It must outlive this object.
  /// @throws InvalidArgument if A has more than four distinct pairs and real eigenvalues, or the
  ///   system does not support the chosen solver
  SimplifiedNewton(const phs::Model& model, std::span<const double> A, Solver solver,
                   DualField* field = nullptr);

  /// The available solvers in the order of trial; for the automatic choice see Solver. Empty if the
  /// system has no resolvent and its field cannot be evaluated in duals.
  const std::vector<Solver>& solvers() const { return solvers_; }
  /// Whether `solver` is factored for steps of size h.
  bool ready(Solver solver, double h) const { return solver == frozen_ && h == h_; }
  /// Fixes J at (t, x), with the turns of the state that x belongs to.
  void freeze(Solver solver, double t, double h, std::span<const double> x,
              const std::vector<std::int64_t>& turns);
  void forget() { frozen_ = Solver::automatic; }
  /// r[k s + i]: number k of stage i.
  void solve(std::span<double> r);

  std::int64_t evaluations() const;
  std::int64_t factorisations() const { return factorisations_; }

  /// The point where J was frozen; loading it repeats the factorisation.
  void carry(Archive& a);

 private:
  phs::Resolvent& resolvent() { return *of(frozen_); }
  phs::Resolvent* of(Solver s);
  void choose_solvers(const phs::Model& model, Solver solver);
  /// Sets forward_, back_ and lambda_.
  void diagonalise(std::span<const double> A);

  size_t s_;
  std::vector<phs::Complex4> forward_, back_;  ///< row i: lanes of T⁻¹, of T
  phs::Complex4 lambda_;
  std::unique_ptr<phs::System<double>> system_;
  std::unique_ptr<DualField> own_field_;
  DualField* field_;
  TurnKeeper<double> keeper_;
  std::unique_ptr<phs::Resolvent> own_;
  std::unique_ptr<DualResolvent> dense_, krylov_;
  std::vector<Solver> solvers_;
  std::vector<phs::Complex4> d_, before_;
  std::int64_t factorisations_ = 0;

  Solver frozen_ = Solver::automatic;  ///< automatic: none
  double t_ = 0, h_ = 0;
  std::vector<double> x_;
  std::vector<std::int64_t> turns_;
};

/// The possible error of a solve for a given residual r. The solve works in double, and (I - h A ⊗
/// J)⁻¹ r is the difference of two numbers of the size of r. If Newton's iteration reaches a point
/// where r is enormous, the computed move may be zero. That is no convergence, so this error counts
/// as a move.
inline double solver_noise(double residual) { return 0x1p-53 * residual; }

/// The parts of a number that Newton's linear solve treats one after another. A derivative obeys
/// the linearised equations, with the same matrix.
template <class T>
inline constexpr int newton_parts = std::is_same_v<T, phs::Dual> ? 2 : 1;
template <class T>
double part_of(const T& x, int part) {
  if constexpr (std::is_same_v<T, phs::Dual>)
    return part == 0 ? x.v : x.d;
  else {
    (void)part;
    return phs::to_double(x);
  }
}
template <class T>
void set_part(T& x, int part, double value) {
  if constexpr (std::is_same_v<T, phs::Dual>)
    (part == 0 ? x.v : x.d) = value;
  else {
    (void)part;
    x = T(value);
  }
}

/// The solver that a step begins with. Fixed-point iteration until three consecutive steps are slow
/// or one fails; then Newton, with a trial of the fixed point every 32 steps, and less often as
/// trials fail. It depends on counts of sweeps only.
class SolverChoice {
 public:
  static constexpr int slow_sweeps = 30;   ///< at a factor 0.3 per sweep: Newton is cheaper
  static constexpr int trial_sweeps = 20;  ///< a trial must end by then

  bool newton() const { return newton_ && wait_ > 0; }
  bool trial() const { return newton_ && wait_ == 0; }
  size_t rung() const { return size_t(rung_); }
  std::int64_t newton_steps() const { return newton_steps_; }
  /// Of the equations, by any solver: a step of a splitting or a composition has several.
  std::int64_t solutions() const { return solutions_; }

  void fixed_point_was(bool converged, int sweeps) {
    solutions_ += converged;
    if (newton_) {  // a trial
      if (converged) {
        newton_ = false;
        slow_ = 0;
      }
      interval_ = std::min(2 * interval_, 4096);
      wait_ = interval_;
      rung_ = 0;
      return;
    }
    slow_ = converged && sweeps < slow_sweeps ? std::min(slow_, 0) : slow_ + 1;
    if (!converged || slow_ == 3) {
      newton_ = true;
      wait_ = interval_;
      rung_ = 0;
    }
  }
  /// No Newton solver converged, although the fixed point may have: Newton is not retried for a
  /// while.
  void newton_failed() {
    newton_ = false;
    slow_ = -interval_;
    interval_ = std::min(2 * interval_, 4096);
  }
  void newton_converged(size_t rung) {
    rung_ = int(rung);
    wait_ = std::max(wait_ - 1, 0);
    ++newton_steps_;
    ++solutions_;
  }

  void carry(Archive& a) {
    a(newton_);
    a(rung_);
    a(slow_);
    a(wait_);
    a(interval_, 1, 4096);
    a(newton_steps_, 0, 0x1p53);
    a(solutions_, 0, 0x1p53);
  }

 private:
  bool newton_ = false;
  int rung_ = 0, slow_ = 0, wait_ = 0, interval_ = 32;
  std::int64_t newton_steps_ = 0, solutions_ = 0;
};

}  // namespace porthos::integrators
