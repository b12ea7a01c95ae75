#pragma once
#include "phs/scalars/scalar.h"

/// Scalars one lane at a time, whether they have one or several.
namespace porthos::phs {

/// One lane of x; x itself where it has one alone.
template <class T>
auto lane_of(const T& x, int lane) {
  if constexpr (is_pack<T>) {
    return x[lane];
  } else {
    (void)lane;
    return x;
  }
}
/// Sets one lane of x; x itself where it has one alone.
template <class T, class U>
void set_lane(T& x, int lane, U value) {
  if constexpr (is_pack<T>) {
    x.set(lane, value);
  } else {
    (void)lane;
    x = value;
  }
}

}  // namespace porthos::phs
