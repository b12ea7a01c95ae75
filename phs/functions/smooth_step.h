#pragma once
#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// 0 up to a, rising to 1 at b with three continuous derivatives: what closes a valve near a bound.
template <class T>
T smooth_step(const T& x, double a, double b) {
  const T s = max(min((x - T(a)) / T(b - a), T(1.0)), T(0.0));
  return s * s * s * s * (T(35.0) + s * (T(-84.0) + s * (T(70.0) - T(20.0) * s)));
}

}  // namespace porthos::phs
