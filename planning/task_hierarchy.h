#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace porthos::planning {

/// A level of a hierarchy: A x = b as well as possible (least squares), within C x ≥ c.
struct TaskLevel {
  std::string name;
  std::vector<double> A;  ///< tasks × n, row after row; scale the rows to weight them
  std::vector<double> b;  ///< one number for each row of A; may be empty
  std::vector<double> C;  ///< limits × n, row after row
  std::vector<double> c;  ///< one number for each row of C; may be empty
};

/// What a level reached, at the solution of the whole hierarchy.
struct LevelOutcome {
  std::string name;
  std::vector<double> error;     ///< A x - b
  std::vector<double> short_of;  ///< max(0, c - C x): by how much each limit could not be kept
  int freedoms = 0;              ///< directions that this level took for its task
  bool met = false;              ///< the task and the limits, to 1e-9 of their size
  /// false: rounding or the number of steps ended the level early. Higher levels are as they were.
  bool solved = true;
  double distance() const;  ///< |A x - b|
};

/// Sets error, short_of and met of a level that was solved or not, at x. @param x  one number for
///   each column of its rows
void judge(const TaskLevel& level, std::span<const double> x, LevelOutcome& outcome);

/// The solution of a hierarchy.
struct HierarchySolution {
  std::vector<double> x;
  std::vector<LevelOutcome> levels;
  int quadratic_programs = 0;  ///< solved; levels within their limits need none
  bool met() const;            ///< every level
};

/// Strict priorities: each level is solved among the solutions of the levels above it (in the null
/// space of their tasks and within their limits), so it cannot disturb them. Limits that the levels
/// above leave no room for are kept as well as possible (least squares), before the level's task.
/// Among several solutions one is chosen; in the last null space the smallest x without limits.
/// Source: Escande, Mansard, Wieber 2014 (Int. J. Robot. Res. 33); each level by Goldfarb, Idnani.
/// Cost: a factorisation of each level's rows, and a quadratic program in what is left free for
/// each level that touches a limit.
class TaskHierarchy {
 public:
  /// @param n  unknowns
  explicit TaskHierarchy(int n);
  ~TaskHierarchy();
  TaskHierarchy(TaskHierarchy&&) noexcept;
  TaskHierarchy& operator=(TaskHierarchy&&) noexcept;

  /// @param levels  the first is the most important
  /// @return valid until the next call
  /// @throws InvalidArgument naming the level: sizes that do not fit, numbers that are not finite
  const HierarchySolution& solve(std::span<const TaskLevel> levels);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace porthos::planning
