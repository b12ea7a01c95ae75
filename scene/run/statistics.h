#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace porthos::scene {

/// Why it is not known how an error grows. no: it is known, or a jump is told in its place.
enum class GrowthUnknown : unsigned char { no, few_records, few_swings, scatter, unequal_rows };
const char* to_string(GrowthUnknown why);  ///< "few records"; of `no` it is empty
/// @throws InvalidArgument for another text
GrowthUnknown growth_unknown(std::string_view text);

/// Statistics of a series of errors at equal intervals of time. O(log n) memory for n records.
///
/// For every j the squares of the non-overlapping increments over 2^j records are summed:
///   S_j = mean (e((i+1) 2^j) - e(i 2^j))²,
/// whose growth with 2^j distinguishes a bounded error (S constant), a random walk (S ~ τ) and a
/// drift (S ~ τ²).
class ErrorStatistics {
 public:
  /// regular: one record interval after the previous one. A last record at another interval is part
  /// of the maximum, the mean square and the end value only.
  void add(double error, bool regular = true);

  std::int64_t count() const { return static_cast<std::int64_t>(count_); }
  double max_abs() const { return max_abs_; }
  double rms() const;
  double change() const { return end_ - start_; }  ///< last - first
  /// How far the series drifts over its length: change(), or, where noise of single records hides
  /// a drift, by the line through the means of its parts.
  double drift() const;

  /// An increment of one record that the whole series tells of: as much lies between the means
  /// before and behind it (stays), or nearly nothing (returns), and little beside it. Else one of
  /// few: with 32 increments or more its square is 0.3 of the sum of all squares, and
  /// the means go to and fro.
  struct Jump {
    enum Kind { none, stays, returns, of_few } kind = none;
    double records = 0;  ///< before it
    double size = 0;     ///< of the increment
  };
  /// None for fewer than 9 records.
  Jump jump() const;

  /// Whether it drifts smoothly and ever more slowly, like t^growth_exponent(), which is below ¾:
  /// the means of the parts rise without exception, and records scatter little in a part.
  bool slows() const;

  /// 0 bounded or constant, ½ a random walk, 1 a drift, more if faster. By how the scatter grows
  /// with the length where the series settles, recurs or explodes (Course): increments tell of
  /// swings only where they are longer than these. Else the least-squares slope of log sqrt(S_j)
  /// against log 2^j over the levels of at least 8 increments, less those within a swing. NaN for
  /// fewer than 3 such levels; for a slope above 0.75 of an error that comes back: less than half
  /// of its increments of the last level, had they one sign, are left at the end; and for one below
  /// 0.25 where the scatter grows with the length by an exponent above 0.15, as of a walk under
  /// noise. NaN for a jump(). Of a series that slows() the exponent of its distance from the start.
  double growth_exponent() const { return growth().exponent; }
  /// Why it is NaN: few_records, few_swings or scatter.
  GrowthUnknown unknown() const { return growth().unknown; }

  /// Whether the records, or their means over parts of the series, have gone further than a random
  /// walk or an oscillation goes. false for an error that settles or jumps.
  bool drift_is_significant() const;

  /// How many times larger the scatter of the records is in the last of 9 to 17 equal parts of the
  /// series than in the first, if it rises from part to part, but for one; or in sixths of it, if
  /// it rises without exception to the fivefold at least, as of swings no longer than a part. The
  /// swings of an error whose increments do not grow with τ may grow with time all the same. Else
  /// 1, and for parts of less than 4 records.
  double swing_growth() const;

  std::vector<double> memory() const;  ///< everything, for checkpoints
  /// @throws InvalidArgument if the size does not fit
  void restore(std::span<const double> memory);

 private:
  /// |e_n - e_0| > 3 s_j sqrt(n_j) for every level j of at least 8 increments, with s_j their
  /// standard deviation and n_j their number: three standard errors of a random walk with these
  /// increments. Level 0 alone would take a slow oscillation seen for less than a period for a
  /// drift. Noise of single records hides a drift from it.
  bool drift_of_records() const;
  /// Whether the means over 9 to 17 equal parts of the series differ from the first to the last by
  /// more than five standard errors of a random walk with their n increments, s sqrt(3n/2), and by
  /// more than the scatter of the records in a part. The factor 3/2 is that of a walk's means,
  /// whose increments are correlated. Means that rise or fall from part to part without exception
  /// are taken for a drift that slows down or speeds up by 3.5 standard errors, with s from the
  /// differences of neighbouring increments. false for fewer than 9 records.
  bool drift_of_means() const;
  struct Level {
    double last = 0, sum_of_squares = 0, count = 0;
  };
  /// Means over parts of equal length.
  struct Parts {
    double length = 1;                         ///< records of a part
    double records = 0, sum = 0, squares = 0;  ///< of the part that is not complete yet
    std::vector<double> means, mean_squares;
    void add(double error);
    /// Variance of the records in a part.
    double scatter(size_t i) const { return variance(i, i + 1); }
    /// Of the records in the parts [from, to).
    double variance(size_t from, size_t to) const;
  };
  /// What the scatter of the records in halves and quarters of the series tells beside the whole.
  /// unknown for parts of less than 4 records.
  struct Course {
    /// settles: next to none in the second half. recurs: nearly all in each quarter, as of swings
    /// that do not grow. explodes: next to none in the first half, and the means do not come back.
    enum Kind { unknown, settles, recurs, explodes } kind = unknown;
    double exponent = 0;  ///< by which the scatter grows with the length; if unknown, the larger
                          ///< one of quarters and parts
  };
  Course course() const;
  bool monotone() const;  ///< the means of the parts, at least 9
  struct Growth {
    double exponent;
    GrowthUnknown unknown = GrowthUnknown::no;
  };
  Growth growth() const;
  Growth slope_of_increments() const;
  bool drifts() const;
  /// log2 of how much farther the means are from the start at the end than half way.
  double power_of_means() const;
  /// The first level whose slope is not that of a drift, if there is any: a swing that is recorded
  /// densely rises on all levels within it.
  size_t first_level() const;
  double count_ = 0, regular_ = 0, max_abs_ = 0, sum_of_squares_ = 0, start_ = 0, end_ = 0;
  double largest_ = 0, largest_at_ = 0;  ///< increment of one record, and the records before it
  Parts parts_;
  std::vector<Level> levels_;
};

}  // namespace porthos::scene
