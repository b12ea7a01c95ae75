#pragma once
#include "phs/scalars/scalar.h"

/// Access to one lane of a scalar; a scalar that is no Pack has one lane.
namespace porthos::phs {

/// One lane of x; x itself if it is no Pack.
template <class T>
auto lane_of(const T& x, int lane) {
  if constexpr (is_pack<T>) {
    return x[lane];
  } else {
    (void)lane;
    return x;
  }
}
/// Sets one lane of x; x itself if it is no Pack.
template <class T, class U>
void set_lane(T& x, int lane, U value) {
  if constexpr (is_pack<T>) {
    x.set(lane, value);
  } else {
    (void)lane;
    x = value;
  }
}
/// Whether two numbers are equal in every lane, and in their derivatives.
template <class T>
bool identical(const T& a, const T& b) {
  if constexpr (is_pack<T>) {
    for (int i = 0; i < lanes<T>; ++i)
      if (!(a[i] == b[i])) return false;
    return true;
  } else if constexpr (requires { a.d; }) {
    return identical(a.v, b.v) && identical(a.d, b.d);
  } else {
    return a == b;
  }
}

}  // namespace porthos::phs
