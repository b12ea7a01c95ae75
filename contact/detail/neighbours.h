#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/geometry/shape.h"

namespace porthos::contact {

/// A ball that holds all that a body reaches [m]. One that is not finite meets every other.
struct Bound {
  Vec3d centre;
  double radius;
};

/// Which of many balls meet, of any sizes, by a grid for each power of two: a ball is in the one
/// cell that has its centre, of a grid whose cells are at least as wide as the ball. It can meet
/// those of its own and of coarser grids in 27 cells alone. The cells are a sorted list, so the
/// order is a function of the balls.
///
/// Source: hierarchical grids, Ericson 2005, section 7.2. Cost: O(n log n + pairs), no allocation
/// after the first calls.
class Neighbours {
 public:
  /// Calls f(i, j), i < j, once for every two balls that meet.
  template <class F>
  void find(std::span<const Bound> balls, const F& f) {
    sort(balls);
    const auto meet = [&](size_t i, size_t j) {
      const Vec3d d = balls[i].centre - balls[j].centre;
      const double r = balls[i].radius + balls[j].radius;
      if (dot(d, d) <= r * r) f(std::min(i, j), std::max(i, j));
    };
    for (size_t k = 0; k < cells_.size(); ++k)
      for (const int level : levels_)
        if (level >= cells_[k].level) look(balls, k, level, meet);
    for (size_t a = 0; a < everywhere_.size(); ++a) {
      const size_t i = everywhere_[a];
      for (size_t b = a + 1; b < everywhere_.size(); ++b) f(i, everywhere_[b]);
      for (const Cell& each : cells_) f(std::min(i, each.ball), std::max(i, each.ball));
    }
  }

 private:
  /// 2^level is the width of its cells [m].
  struct Cell {
    int level;
    std::array<std::int64_t, 3> at;
    size_t ball;
    // NOLINTNEXTLINE(modernize-use-nullptr): a 0 of the compiler, not of this line
    auto operator<=>(const Cell&) const = default;
  };
  static constexpr double most_cells = 1e15;  ///< from the origin; further out a ball is everywhere

  static std::array<std::int64_t, 3> cell(const Vec3d& centre, int level) {
    const auto along = [&](double x) { return std::int64_t(std::floor(std::ldexp(x, -level))); };
    return {along(centre.x), along(centre.y), along(centre.z)};
  }
  void sort(std::span<const Bound> balls) {
    cells_.clear();
    levels_.clear();
    everywhere_.clear();
    for (size_t i = 0; i < balls.size(); ++i) {
      const auto& [c, r] = balls[i];
      const bool finite = r > 0 && r < HUGE_VAL && dot(c, c) < HUGE_VAL;
      const int level = finite ? std::ilogb(r) + 2 : 0;
      if (!finite || !(std::ldexp(norm(c), -level) < most_cells)) {
        everywhere_.push_back(i);
        continue;
      }
      if (std::find(levels_.begin(), levels_.end(), level) == levels_.end())
        levels_.push_back(level);
      cells_.push_back({level, cell(c, level), i});
    }
    std::sort(cells_.begin(), cells_.end());
  }
  /// The balls of a level that are near cell k; of its own level those after it.
  template <class Meet>
  void look(std::span<const Bound> balls, size_t k, int level, const Meet& meet) {
    const Cell& own = cells_[k];
    const bool same = level == own.level;
    const auto at = cell(balls[own.ball].centre, level);
    for (int dx = same ? 0 : -1; dx <= 1; ++dx)
      for (int dy = same && dx == 0 ? 0 : -1; dy <= 1; ++dy) {
        const Cell first{level, {at[0] + dx, at[1] + dy, at[2] - 1}, 0};
        auto each = same && dx == 0 && dy == 0
                        ? cells_.begin() + long(k) + 1
                        : std::lower_bound(cells_.begin(), cells_.end(), first);
        for (; each != cells_.end() && each->level == level && each->at[0] == first.at[0] &&
               each->at[1] == first.at[1] && each->at[2] <= at[2] + 1;
             ++each)
          meet(own.ball, each->ball);
      }
  }

  std::vector<Cell> cells_;
  std::vector<int> levels_;
  std::vector<size_t> everywhere_;
};

}  // namespace porthos::contact
