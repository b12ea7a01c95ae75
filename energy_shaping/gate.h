#pragma once
#include "phs/scalars/scalar.h"

namespace porthos::energy_shaping {

/// 0 up to a, rising smoothly to 1 at b: closes the valves of a tank near its bounds.
template <class T>
T gate(T x, double a, double b) {
  const T s = phs::max(phs::min((x - T(a)) / T(b - a), T(1.0)), T(0.0));
  return s * s * (T(3.0) - T(2.0) * s);
}

}  // namespace porthos::energy_shaping
