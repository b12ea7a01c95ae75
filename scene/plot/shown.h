#pragma once
#include <cmath>
#include <cstdint>
#include <vector>

#include "scene/plot/trace_plot.h"

namespace porthos::scene {

inline constexpr std::int64_t most_shown = 1500;  ///< values of a line in a picture

/// At most `most` of `count` records for a line, the first and the last among them: one of each of
/// equal parts, anywhere in it but always the same. Equal distances would show a swing that is
/// faster than they are as a slow one.
std::vector<std::int64_t> thinned(std::int64_t count, std::int64_t most);
/// At most `most` of `count` records, equally far apart, the first and the last among them.
std::vector<std::int64_t> evenly(std::int64_t count, std::int64_t most);

/// The least and the largest of a part of a series, in the order in which they came; nan where it
/// has no number.
class LeastAndLargest {
 public:
  void add(double x) {
    if (std::isnan(x)) return;
    const bool none = std::isnan(least_);
    if (none || x > largest_) {
      largest_ = x;
      falls_ = false;
    }
    if (none || x < least_) {
      least_ = x;
      falls_ = !none;
    }
  }
  double first() const { return falls_ ? largest_ : least_; }
  double second() const { return falls_ ? least_ : largest_; }

 private:
  double least_ = std::nan(""), largest_ = least_;
  bool falls_ = false;
};

/// What a picture shows of records: all, or so many of them that a line holds.
class Shown {
 public:
  /// At most `most` of `count` records: all, or those of thinned().
  static Shown records(std::int64_t count, std::int64_t most);
  /// At most `most` values: of more records the least and the largest of each part, of 16 records
  /// in it. A swing faster than the picture fills its band.
  static Shown bands(std::int64_t count, std::int64_t most);

  /// The records to read, in order.
  const std::vector<std::int64_t>& rows() const { return rows_; }
  /// Those of a whole series.
  std::vector<double> picked(const std::vector<double>& all) const;
  /// The times of what is shown. t: of rows()
  std::vector<double> times(const std::vector<double>& t) const;
  /// What is shown of a series: of a part the least and the largest, in the order in which they
  /// came. nan where a part has no other. v: of rows()
  std::vector<double> values(const std::vector<double>& v) const;
  /// What is shown of panels whose lines are of rows().
  void reduce(std::vector<TracePanel>& panels) const;

 private:
  std::vector<std::int64_t> rows_;
  std::vector<std::size_t> parts_ = {};  ///< where they begin, then the end; empty: each is shown
};

}  // namespace porthos::scene
