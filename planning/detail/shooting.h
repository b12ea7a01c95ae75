#pragma once
#include <memory>

#include "planning/detail/gauss_interval.h"
#include "planning/detail/riccati_qp.h"

namespace porthos::planning::detail {

/// All intervals of a problem: its equations, their derivatives and the quadratic programme of a
/// Newton step. Unknowns are one vector v = (x_0 … x_N, w_0 … w_{N-1}).
class Shooting {
 public:
  explicit Shooting(const Problem& problem);

  long nx() const { return nx_; }
  long nw() const { return nw_; }
  long N() const { return N_; }
  long unknowns() const { return (N_ + 1) * nx_ + N_ * nw_; }
  long at_x(long k) const { return k * nx_; }
  long at_w(long k) const { return (N_ + 1) * nx_ + k * nw_; }

  /// Solves all intervals at v. @return false where a step has no solution
  bool evaluate(const Vector& v);
  /// The same at a point that this chooses: v + α move, but every state is where the interval
  /// before ends, less what is left of its defect, and the inputs follow the states by the law of
  /// `sweep`.
  bool follow(const Vector& v, const Vector& move, double alpha, const RiccatiQp& sweep,
              Vector& trial);
  /// The same with states that follow from the inputs of v; they are replaced.
  bool roll(Vector& v);
  /// After evaluate(): cost, x' - x_{k+1} of each interval, the goals' values minus what they must
  /// be, and the sum of the moduli of both.
  double cost = 0;
  Vector defects, goals;
  double infeasibility() const { return defects.lpNorm<1>() + goals.lpNorm<1>(); }
  double largest_defect() const;

  /// After evaluate(): A, B, the gradients, d, C and c of the programme.
  void differentiate();
  /// The numbers with limits at the stages of all intervals (GaussInterval::path()).
  long path() const { return N_ * intervals_.front().path().size(); }
  void copy_path(double* to) const;
  /// After differentiate(): their derivatives along a move of the unknowns.
  void path_along(const Vector& dv, double* to) const;
  const Matrix& path_rows(long k) const { return intervals_[size_t(k)].path_rows(); }
  /// The limits of the unknowns, x_0 without, and of path(); -inf and inf where there is none.
  void limits(Vector& low, Vector& high) const;
  /// gradient += weightsᵀ ∂path by the unknowns, without x_0.
  void add_path(const double* weights, Vector& gradient) const;
  /// Adds σ rᵀr to the block H and slope r to g of the programme, r the derivative of number i of
  /// path().
  void add_to_programme(long i, double sigma, double slope);

  /// After differentiate(): the blocks H, at the multipliers λ ((N + 1) nx) and ν, and `weights`
  /// of path(); null: 0.
  void curve(const Vector& lambda, const Vector& nu, bool exact, const double* weights = nullptr);
  /// Sets the programme's g again, to which a barrier may have added.
  void renew_slopes();
  /// After differentiate(): the gradient by v of cost + λᵀ(defects) + νᵀ(goals), without x_0.
  void slope(const Vector& lambda, const Vector& nu, Vector& gradient) const;
  /// After differentiate(): the derivative of cost + λᵀ(defects) + weightsᵀ path by the duration.
  double by_duration(const Vector& lambda, const double* weights) const;
  /// λ_0: the derivative of the cost by the start.
  Vector at_start(const Vector& lambda) const;

  QuadraticProgramme qp;
  /// Sets the programme's d and c; differentiate() sets those of evaluate().
  void set_equations(const Vector& defects, const Vector& goals);

 private:
  void evaluate_goals(const double* x);

  const Problem& p_;
  long nx_, nw_, N_;
  std::shared_ptr<const integrators::CollocationTable<double>> table_;
  std::vector<GaussInterval> intervals_;
  std::vector<double> f_, J_, H_, none_;  ///< at the end; none: inputs that are 0
  std::vector<double> last_, nu_x_;       ///< x_N; multipliers of goals on rates, or a gradient
};

}  // namespace porthos::planning::detail
