#pragma once
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "mechanics/rotation.h"

namespace porthos::mechanics {

/// The angles a about the axes x, y, z [rad] of which a rotation is made in a sequence of three
/// axes: R = R_i(a_i) R_j(a_j) R_k(a_k) for "ijk", each turn about an axis that the turns before it
/// have moved. a_i and a_k are in [-π, π], a_j in [-π/2, π/2]; at ±π/2, where only a_i ± a_k
/// matters, a_k is 0. Source: Bernardes, Viollet 2022 ("Quaternion to Euler angles conversion",
/// PLoS ONE 17), here for moving axes.
/// @param q  its quaternion, of any length but 0
/// @param sequence  the letters x, y, z in any order: "zyx" has the yaw, the pitch and the roll
inline Vec3<double> euler_angles(const Quaternion<double>& q, std::string_view sequence) {
  const int i = sequence[0] - 'x', j = sequence[1] - 'x', k = sequence[2] - 'x';
  const double sign = (j - i + 3) % 3 == 1 ? 1 : -1;  // e_k = sign e_i × e_j
  // R R_j(π/2) = R_i(a_i) R_j(a_j + π/2) R_i(-sign a_k): angles about two axes only.
  const double w = q.w - q.v[j], along_i = q.v[i] - sign * q.v[k], along_j = q.v[j] + q.w,
               across = sign * q.v[k] + q.v[i];
  const double cosine = std::hypot(w, along_i), sine = std::hypot(along_j, across);
  double sum = std::atan2(along_i, w), difference = std::atan2(across, along_j);  // of halves
  constexpr double locked = 1e-15;  // of the longer one: rounding
  if (sine <= locked * cosine) difference = sum;
  if (cosine <= locked * sine) sum = difference;
  std::array<double, 3> a{};
  a[size_t(i)] = std::remainder(sum + difference, 2 * std::numbers::pi);
  a[size_t(j)] = 2 * std::atan2(sine, cosine) - std::numbers::pi / 2;
  a[size_t(k)] = -sign * std::remainder(sum - difference, 2 * std::numbers::pi);
  return {a[0], a[1], a[2]};
}

}  // namespace porthos::mechanics
