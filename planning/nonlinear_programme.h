#pragma once
#include <memory>
#include <span>
#include <vector>

#include "planning/planner.h"

namespace porthos::planning {

/// A problem as a nonlinear programme, for a solver of another library:
///
///   min J(z),   lower <= z <= upper,   lower <= c(z) <= upper
///
/// The unknowns z are the states and inputs of a Trajectory, x before u; x_0 is held by its limits.
/// The rows c are the steps x'(x_k, w_k) - x_{k+1} = 0, the goals, and the numbers with limits at
/// the stages. The stages are solved inside, so derivatives are those of the steps. One object per
/// thread.
class NonlinearProgramme {
 public:
  using In = std::span<const double>;
  using Out = std::span<double>;
  struct Bounds {
    std::vector<double> lower, upper;  ///< -inf and inf where there is none
  };
  /// Where the numbers of a sparse matrix are, from 0.
  struct Pattern {
    std::vector<int> row, column;
  };

  /// @param problem  outlives this. @throws InvalidArgument as Problem::check()
  explicit NonlinearProgramme(const Problem& problem);
  ~NonlinearProgramme();

  const Bounds& unknowns() const;
  const Bounds& rows() const;
  const Pattern& jacobian_pattern() const;
  const Pattern& hessian_pattern() const;  ///< of the lower triangle

  /// Goes to a point, at which all that follows is. @return false where a step has no solution
  bool go_to(In z);
  double cost() const;
  void values(Out c) const;    ///< of the rows, as many as rows() has
  void gradient(Out g);        ///< ∂J/∂z, as many as unknowns() has
  void jacobian(Out numbers);  ///< ∂c/∂z, one number for each place of jacobian_pattern()
  /// ∇²(cost_factor J + multipliersᵀ c), one number for each place of hessian_pattern().
  /// multipliers: one for each row
  void hessian(double cost_factor, In multipliers, Out numbers);

  /// What another solver found, judged by the conditions of planning::solve(): all but status,
  /// iterations, evaluations and history.
  /// @param multipliers  of the rows, of J + multipliersᵀ c. @param lower, upper  of the limits of
  ///   z, 0 or more
  Plan plan(In z, In multipliers, In lower, In upper) const;

 private:
  struct Work;
  std::unique_ptr<Work> w_;
};

}  // namespace porthos::planning
