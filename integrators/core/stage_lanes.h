#pragma once
#include <array>
#include <type_traits>

#include "integrators/core/stagnation.h"
#include "phs/scalars/scalar.h"

/// Stage data lane by lane: machine lanes for double, a plain array for the other scalars.
namespace porthos::integrators {

/// W numbers of a scalar without lanes, with the interface of a Pack.
template <class T, int W>
struct StageArray {
  T v[W];

  StageArray() = default;
  explicit StageArray(T x) {
    for (T& y : v) y = x;
  }
  const T& operator[](int i) const { return v[i]; }
  void set(int i, T x) { v[i] = x; }

#define PORTHOS_LANEWISE(op)                                         \
  friend StageArray operator op(StageArray a, const StageArray& b) { \
    for (int i = 0; i < W; ++i) a.v[i] = a.v[i] op b.v[i];           \
    return a;                                                        \
  }
  PORTHOS_LANEWISE(+)
  PORTHOS_LANEWISE(-)
  PORTHOS_LANEWISE(*)
  PORTHOS_LANEWISE(/)
#undef PORTHOS_LANEWISE
  StageArray& operator+=(const StageArray& b) { return *this = *this + b; }
  friend StageArray fma(const StageArray& a, const StageArray& b, StageArray c) {
    using phs::fma;
    for (int i = 0; i < W; ++i) c.v[i] = fma(a.v[i], b.v[i], c.v[i]);
    return c;
  }
};

/// The number of stages per machine register: eight with AVX-512, else four.
inline constexpr int stage_lanes = phs::native_lanes >= 8 ? 8 : 4;

template <class T, int W>
using StageLanes =
    std::conditional_t<std::is_same_v<T, double>, phs::Pack<double, W>, StageArray<T, W>>;

/// Sizes of stage data, lane by lane.
template <int W>
using Magnitudes = phs::Pack<double, W>;

/// |x| lane by lane.
template <int W>
Magnitudes<W> magnitudes(const phs::Pack<double, W>& x) {
  return abs(x);
}
/// |x| lane by lane.
template <class T, int W>
Magnitudes<W> magnitudes(const StageArray<T, W>& x) {
  Magnitudes<W> m;
  for (int i = 0; i < W; ++i) m.set(i, magnitude(x[i]));
  return m;
}
/// Σ x_i over s stages, outer pairs first because weights are symmetric. at(i): x_i
template <class T, class At>
T sum_of_stages(int s, const At& at) {
  T all(0.0);
  for (int i = 0; i < s / 2; ++i) all += at(i) + at(s - 1 - i);
  return s % 2 ? all + at(s / 2) : all;
}
/// The largest lane of each of W packs, in the lanes of one.
template <int W>
Magnitudes<W> largest_of_each(std::array<Magnitudes<W>, W> x) {
  constexpr int in_one_register = W <= phs::native_lanes ? W : 0;
  if constexpr (in_one_register == 4) {
    const auto pair = [](auto a, auto b) {
      return max(Magnitudes<W>(__builtin_shufflevector(a.v, b.v, 0, 2, 4, 6)),
                 Magnitudes<W>(__builtin_shufflevector(a.v, b.v, 1, 3, 5, 7)));
    };
    return pair(pair(x[0], x[1]), pair(x[2], x[3]));
  } else if constexpr (in_one_register == 8) {
    const auto pair = [](auto a, auto b) {
      return max(Magnitudes<W>(__builtin_shufflevector(a.v, b.v, 0, 2, 4, 6, 8, 10, 12, 14)),
                 Magnitudes<W>(__builtin_shufflevector(a.v, b.v, 1, 3, 5, 7, 9, 11, 13, 15)));
    };
    return pair(pair(pair(x[0], x[1]), pair(x[2], x[3])), pair(pair(x[4], x[5]), pair(x[6], x[7])));
  } else {
    Magnitudes<W> each;
    for (int i = 0; i < W; ++i) {
      double largest = x[size_t(i)][0];
      for (int j = 1; j < W; ++j) largest = x[size_t(i)][j] > largest ? x[size_t(i)][j] : largest;
      each.set(i, largest);
    }
    return each;
  }
}
/// The largest lane.
template <int W>
double largest_of(const Magnitudes<W>& x) {
  double r = x[0];
  for (int i = 1; i < W; ++i) r = x[i] > r ? x[i] : r;
  return r;
}

}  // namespace porthos::integrators
