#pragma once
#include "mechanics/spatial.h"
#include "phs/scalars/pack.h"

/// Small products of the system of parts.
namespace porthos::space {

using mechanics::Mat3;
using mechanics::Vec3;
using mechanics::Vec3d;

/// f(t), lane by lane.
template <class T, class F>
T lane_by_lane(const T& t, F f) {
  if constexpr (phs::is_pack<T>) {
    T r;
    for (int i = 0; i < phs::lanes<T>; ++i) r.set(i, f(t[i]));
    return r;
  } else {
    return T(f(phs::to_double(t)));
  }
}

template <class T>
Vec3<T> scaled(const Vec3d& k, const Vec3<T>& a) {
  return {T(k.x) * a.x, T(k.y) * a.y, T(k.z) * a.z};
}
template <class T>
Vec3<T> zero() {
  return {T(0.0), T(0.0), T(0.0)};
}
/// ½ (A K Aᵀ + B K Bᵀ) a
template <class T>
Vec3<T> along_both(const Mat3<T>& A, const Mat3<T>& B, const Vec3d& k, const Vec3<T>& a) {
  return T(0.5) * (A * scaled(k, A.tmul(a)) + B * scaled(k, B.tmul(a)));
}
template <class T>
const Vec3<T>& column_of(const Mat3<T>& R, int i) {
  return i == 0 ? R.x : i == 1 ? R.y : R.z;
}

}  // namespace porthos::space
