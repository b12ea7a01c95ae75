#pragma once
#include "planning/detail/shooting.h"
#include "planning/planner.h"

namespace porthos::planning::detail {

/// Newton's iteration on the optimality conditions of a problem; see planning::solve().
class NewtonIteration {
 public:
  /// @param careful  where the programme is not convex: second derivatives of f are kept, and steps
  ///   are shorter; slower near an optimum, and safer far from one
  NewtonIteration(const Problem& problem, const Trajectory& guess, const PlannerOptions& options,
                  bool careful = false);
  Plan run();
  /// What another solver found: all but how it was found.
  /// @param lambda  of the steps, λ_1 to λ_N
  /// @param lower,upper  of limits of v and of the numbers at the stages
  Plan judge(const Vector& v, const Vector& lambda, const Vector& nu, const Vector& lower,
             const Vector& upper);
  static Vector joined(const Vector& v, const Vector& slacks);

 private:
  /// An iterate: unknowns and all multipliers.
  struct Point {
    Vector v, lambda, nu;
    /// What may have limits: v, and for each number with one at a stage a slack that it shall be
    /// equal to.
    Vector c;
    Vector lower, upper;  ///< multipliers of limits of c, 0 where there is none
  };
  struct Move {
    Vector v, lambda, nu, c, lower, upper;
  };
  struct Residuals {
    double defect = 0, stationarity = 0, complementarity = 0;
    double largest() const { return std::max({defect, stationarity, complementarity}); }
  };

  void set_limits();
  void move_inside(Vector& v) const;
  bool begin();
  Vector path() const;
  double infeasibility(const Vector& c) const;
  std::pair<double, double> barrier_of(long i) const;
  Vector moved_slacks(const Move& move, double alpha) const;
  const double* of_path(const Vector& c) const { return c.data() + shooting_.unknowns(); }
  void estimate_multipliers();
  Residuals residuals(double barrier);
  bool lower_barrier();
  double barrier_at(const Vector& c, double cost) const;

  bool step(Move& move, bool exact);
  void set_up(bool exact);
  bool try_sweep();
  bool weigh_all(double scale);
  void read_move(Move& move) const;
  double rho_unit() const;
  double room(const Vector& c, const Vector& dc) const;
  double room_of(const Vector& z, const Vector& dz) const;

  bool search(const Move& move);
  bool search_extremal(const Move& move);
  bool search_afresh(const Move& move);
  bool accept(double theta, double phi, double alpha, double slope, double theta0, double phi0);
  bool inside(const Vector& c) const;
  void take(const Move& move, double alpha, double alpha_dual, const Vector& v);
  void finish(Plan& plan);
  bool polish(Plan& plan);

  const Problem& p_;
  const PlannerOptions& o_;
  const bool careful_;
  Shooting shooting_;
  RiccatiQp sweep_;
  Point at_;
  Vector low_, high_;          ///< limits of c
  std::vector<long> limited_;  ///< the numbers with limits, unknowns first
  Vector gradient_;            ///< by the unknowns of the Lagrangian
  double barrier_ = 0, last_step_ = 0;
  double regularisation_ = 0, last_regularisation_ = 0, last_weight_ = 0, rho_ = 0;
  std::vector<std::pair<double, double>> filter_;  ///< infeasibility and barrier function
  double most_infeasible_ = 0;
  bool nearly_stationary_ = false;
  int evaluations_ = 0;
};

}  // namespace porthos::planning::detail
