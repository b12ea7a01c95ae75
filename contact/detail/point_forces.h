#pragma once
#include "contact/detail/gaps.h"

/// Motion and forces at the points of soft contacts.
namespace porthos::contact {

/// How two shapes move at a point where they touch.
template <class T>
struct Slip {
  T depth_rate;   ///< δ' [m/s]
  Vec3<T> along;  ///< of B relative to A, across the normal, world axes [m/s]
};
/// At point i of a pair, by the twists in gaps.w.V.
template <class T>
Slip<T> slip(const Gaps<T>& gaps, size_t pair, size_t i) {
  const Vec3<T> v = gaps.apart(pair, i);
  const Vec3<T>& n = gaps.touch[i].n;
  const T apart = dot(n, v);
  return {-apart, fma(-apart, n, v)};
}

/// The coefficients c and c_t of a point: the force on B is (f + c δ') n - c_t v.
template <class T>
struct Resistance {
  T loss, friction;
};
template <class T>
Resistance<T> resistance(const Law& law, const T& elastic, const Slip<T>& v) {
  return {loss_coefficient(law, elastic, v.depth_rate),
          law.friction > 0 ? friction_coefficient(law, elastic, v.depth_rate, dot(v.along, v.along))
                           : T(0.0)};
}

}  // namespace porthos::contact
