#pragma once
#include <array>

#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// Collocation with eight stages at the left Radau nodes on [0, 1], c_0 = 0, order 15. Computed in
/// 113 bits, rounded once.
template <class T>
struct RadauTable {
  static constexpr int s = 8;
  std::array<T, s> c, b;
  std::array<double, s> b_lo;  ///< rounding error of b
  std::array<std::array<T, s>, s> a;
  /// The polynomial sum_j l_j(theta) F_j: row m has the coefficients of theta^m.
  std::array<std::array<T, s>, s> power;

  /// step_weights() of b
  std::array<T, s> weights(T h) const;
  /// The integral of l_j over [1, theta], for j = 0 .. 7.
  std::array<T, s> beyond(T theta) const;
};

/// The single table, made at its first use. T = double or Quad.
template <class T>
const RadauTable<T>& radau_table();
/// The same step in the form of the others.
template <class T>
CollocationTable<T> radau_steps();

}  // namespace porthos::integrators
