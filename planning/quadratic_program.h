#pragma once
#include <memory>
#include <vector>

namespace porthos::planning {

/// min ½ xᵀG x + aᵀx  where the first `equalities` rows hold as C x = c and the others as C x ≥ c.
struct QuadraticProgram {
  int n = 0;              ///< unknowns
  int equalities = 0;     ///< the first rows of C
  std::vector<double> G;  ///< n × n, symmetric, positive definite; its lower triangle is read
  std::vector<double> a;  ///< n
  std::vector<double> C;  ///< rows × n, row after row
  std::vector<double> c;  ///< one number for each row
  int rows() const { return static_cast<int>(c.size()); }
};

/// What a solver found.
struct QpSolution {
  enum class Status { optimal, infeasible, too_many_steps };
  Status status = Status::too_many_steps;
  std::vector<double> x;  ///< n
  /// One for each row: G x + a = Cᵀ multipliers; of inequalities not negative, zero unless active.
  std::vector<double> multipliers;
  double value = 0;         ///< ½ xᵀG x + aᵀx
  std::vector<int> active;  ///< the rows that hold with equality and carry a multiplier
  /// If infeasible: rows that contradict each other, and weights (of inequalities not negative)
  /// with which the rows add up to 0 and the right-hand sides to more than 0 (Farkas).
  std::vector<int> conflict;
  std::vector<double> conflict_weights;
  int steps = 0;  ///< rows added and dropped after the equalities and the rows of a warm start
};

/// The dual active-set method: from the minimum without inequalities it adds violated rows one by
/// one and keeps the multipliers' signs.
/// Source: Goldfarb, Idnani 1983 (Math. Program. 27); rows are added by reflections.
/// Cost: n³ for the factors, 4 n² for each row added. Allocates only when a size grows.
class QpSolver {
 public:
  QpSolver();
  ~QpSolver();
  QpSolver(QpSolver&&) noexcept;
  QpSolver& operator=(QpSolver&&) noexcept;

  enum class Start { cold, warm };
  /// @param start  warm: the rows that were active in the last solution are tried first; they are
  ///   ignored if the number of rows or unknowns has changed. The solution is the same.
  /// @return valid until the next call
  /// @throws InvalidArgument for sizes that do not fit, numbers that are not finite, a G that is
  ///   not positive definite
  const QpSolution& solve(const QuadraticProgram& program, Start start = Start::cold);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace porthos::planning
