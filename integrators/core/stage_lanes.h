#pragma once
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
/// The largest lane.
template <int W>
double largest_of(const Magnitudes<W>& x) {
  double r = x[0];
  for (int i = 1; i < W; ++i) r = x[i] > r ? x[i] : r;
  return r;
}

}  // namespace porthos::integrators
