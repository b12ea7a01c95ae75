#pragma once
#include <bit>
#include <type_traits>

#include "integrators/core/stagnation.h"
#include "phs/scalars/scalar.h"
#include "phs/system/archive.h"

/// How a method written once over the scalar T addresses its lanes. A Pack has one lane per number;
/// any other scalar is one lane.
namespace porthos::integrators {

using phs::select;

/// A set of lanes, one bit each.
using LaneSet = unsigned;
inline constexpr LaneSet lane_bit(int lane) { return 1u << lane; }

/// The mask for select() of some lanes of a T.
template <class T>
auto mask_of(LaneSet lanes) {
  if constexpr (phs::is_pack<T>) {
    T in(0.0);
    for (int l = 0; l < phs::lanes<T>; ++l)
      if (lanes & lane_bit(l)) in.set(l, 1.0);
    return in > T(0.0);
  } else {
    return lanes != 0;
  }
}
/// The same for a set that is not empty; free of cost if there is only one lane.
template <class T>
auto mask_of_some(LaneSet lanes) {
  if constexpr (phs::is_pack<T>)
    return mask_of<T>(lanes);
  else {
    (void)lanes;
    return true;
  }
}
/// The lanes of a mask.
inline LaneSet lanes_of(bool mask) { return mask ? 1u : 0u; }
template <int W, bool native>
LaneSet lanes_of(const phs::Mask<W, native>& mask) {
  LaneSet lanes = 0;
  for (int l = 0; l < W; ++l)
    if (mask[l]) lanes |= lane_bit(l);
  return lanes;
}
template <class F>
void for_each_lane(LaneSet lanes, F f) {
  for (; lanes; lanes &= lanes - 1) f(std::countr_zero(lanes));
}

/// Lanes whose step ended in a round of work: it is done or has failed.
struct Ended {
  LaneSet done = 0, not_converged = 0, not_finite = 0;
  LaneSet failed() const { return not_converged | not_finite; }
  bool any() const { return (done | failed()) != 0; }
};

/// The type of magnitude(): the size of a T, lane by lane.
template <class T>
using Size = std::conditional_t<phs::is_pack<T>, T, double>;
template <int W, bool native>
phs::Pack<double, W, native> magnitude(const phs::Pack<double, W, native>& x) {
  return abs(x);
}
/// One lane of a number, as a double.
template <class T>
double in_lane(const T& x, int lane) {
  if constexpr (phs::is_pack<T>)
    return x[lane];
  else {
    (void)lane;
    return phs::to_double(x);
  }
}

/// Saves or loads one lane of a number.
template <class T>
void carry_lane(Archive& a, T& x, int lane) {
  if constexpr (phs::is_pack<T>) {
    double y = x[lane];
    a(y);
    x.set(lane, y);
  } else {
    (void)lane;
    a(x);
  }
}

}  // namespace porthos::integrators
