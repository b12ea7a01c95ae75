#pragma once
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace porthos::phs {

/// The order in which a sparse symmetric matrix of blocks is eliminated, and where its elements are
/// kept: chosen once, for all matrices with this pattern.
///
/// Blocks are ordered by minimum degree (Tinney, Walker 1967). Blocks with the same neighbours, and
/// blocks that can be eliminated together without more fill, become one front, whose rows are
/// pivoted against each other. Blocks that are connected make one front if that needs at most twice
/// the elements: the matrix is small or dense.
class BlockPattern {
 public:
  /// Rows that are eliminated together. Its elements are a matrix, row-major, with `size` columns;
  /// its rows are those of the front, then those below.
  struct Front {
    int at, size;            ///< its rows are the places at ... at + size - 1
    std::vector<int> below;  ///< later places in its columns, ascending
    std::size_t data;        ///< offset of its elements
  };
  /// A block of elements: (i, j) is at offset + i stride + j.
  struct Location {
    std::size_t offset, stride;
  };

  /// @param sizes  rows of each block; neighbours: pairs of blocks that share elements, in any
  ///   order, repeated or not
  BlockPattern(std::span<const int> sizes, std::span<const std::pair<int, int>> neighbours);
  BlockPattern() = default;

  /// Rows of the matrix. A row's *place* is its position in the order of elimination.
  int rows() const { return rows_; }
  std::size_t elements() const { return elements_; }
  const std::vector<Front>& fronts() const { return fronts_; }
  /// The front that eliminates a place.
  int front_of(int place) const { return front_of_[std::size_t(place)]; }
  /// The place of a block's first row; the others follow.
  int place(int block) const { return place_[std::size_t(block)]; }
  /// Where the elements of a pair of blocks are, place(row) >= place(column): the lower triangle.
  Location locate(int row, int column) const;

 private:
  void set_fronts(const std::vector<std::vector<int>>& members,
                  const std::vector<std::vector<int>>& later, std::span<const int> sizes);

  int rows_ = 0;
  std::size_t elements_ = 0;
  std::vector<int> place_, front_of_;
  std::vector<Front> fronts_;
};

}  // namespace porthos::phs
