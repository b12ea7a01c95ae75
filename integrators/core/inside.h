#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "phs/scalars/scalar.h"

namespace porthos::integrators {

/// The distance from the ends of a step, from t by h, at which forces that may jump there (a
/// switching thruster) are evaluated. It exceeds the rounding of both times but is far too small to
/// affect a continuous force. At t + hair and t + h - hair, a step sees the limits from its inside.
template <class T>
T hair(const T& t, const T& h) {
  const double from = phs::to_double(t), size = phs::to_double(h);
  return T(std::copysign(0x1p-46 * std::max(std::fabs(from), std::fabs(from + size)), size));
}

/// Whether t is one of these ascending times, up to rounding.
inline bool jumps_at(const std::vector<double>& instants, double t) {
  const double near = std::fabs(hair(t, 0.0));
  const auto next = std::lower_bound(instants.begin(), instants.end(), t - near);
  return next != instants.end() && *next <= t + near;
}

}  // namespace porthos::integrators
