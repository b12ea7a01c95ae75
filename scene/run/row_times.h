#pragma once
#include <cstddef>
#include <vector>

namespace porthos::scene {

/// The instants of the rows of a trajectory. Row i follows row i - 1 by interval(i).
struct Rows {
  /// @param times  two or more, which must outlive it [s]
  explicit Rows(const std::vector<double>& times);
  const std::vector<double>& t;  ///< [s]
  double step;                   ///< the interval; if unequal, that in the middle [s]
  bool equal, mostly_equal;      ///< all intervals, half of them
  size_t others = 0;             ///< intervals of another length

  double interval(size_t i) const { return t[i] - t[i - 1]; }
  /// Whether rows are missing before row i, where most are at equal intervals.
  bool is_hole(size_t i) const { return mostly_equal && interval(i) > 1.5 * step; }
  std::vector<size_t> holes() const;
  /// Whether row i has two rows before and one behind it without a hole.
  bool resolve(size_t i) const;
};

/// The instants of the rows behind which others are missing [s], in order.
std::vector<double> before_holes(const std::vector<double>& times);

}  // namespace porthos::scene
