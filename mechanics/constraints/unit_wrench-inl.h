#pragma once
#include <cmath>
#include <span>
#include <type_traits>

#include "mechanics/constraints/constraint_set.h"
#include "mechanics/passes-inl.h"

namespace porthos::mechanics::constraint_detail {

/// Rows of one constraint at once: in the lanes of S if T is double, else one.
template <class T>
struct RowLanes {
  static constexpr bool wide = std::is_same_v<T, double>;
  using S = std::conditional_t<wide, phs::Pack8, T>;
  static constexpr int width = wide ? phs::lanes<phs::Pack8> : 1;

  /// Of row i; x: S, or a size.
  template <class X>
  static auto row(const X& x, int i) {
    if constexpr (wide)
      return x[i];
    else
      return x;
  }
  static void set(S& x, int i, const T& row) {
    if constexpr (wide)
      x.set(i, row);
    else
      x = row;
  }
};

/// The size of a scalar, lane by lane.
template <class T>
using Size = std::conditional_t<phs::is_pack<T>, T, double>;
template <class T>
Size<T> size_of(const T& x) {
  if constexpr (phs::is_pack<T>)
    return abs(x);
  else
    return std::fabs(phs::to_double(x));
}

/// The length of a vector of scalars.
template <class T>
Size<T> length_of(const Vec3<T>& x) {
  using std::sqrt;
  return sqrt(size_of(dot(x, x)));
}

/// Upper bounds of a wrench's moment and force: what they could be if nothing lay in line.
template <class R>
struct Reach {
  R moment{0.0}, force{0.0};

  void operator+=(const Reach& r) {
    moment = moment + r.moment;
    force = force + r.force;
  }
  /// About a point at the distance r.
  Reach moved(const R& r) const { return {moment + r * force, force}; }
};

/// A wrench on a frame of a node, in the node's axes about its origin.
template <class T>
struct OnNode {
  int node = -1;  ///< -1: the world
  Force<T> wrench;
  Reach<Size<T>> reach;

  OnNode() = default;
  OnNode(int on, const Transform<T>& frame, const Force<T>& w)
      : node(on),
        wrench(frame.to_parent(w)),
        reach(Reach<Size<T>>{length_of(w.n), length_of(w.f)}.moved(length_of(frame.r))) {}
};

/// What one unit of each row's multiplier does: wrenches on two nodes, and joint forces. T: a row
/// in each lane (RowLanes).
template <class T>
struct UnitWrench {
  int row, rows;
  std::span<const int> above;  ///< every node below which it acts, leaves first
  std::span<const ConstraintSet::Term> terms;
  OnNode<T> a, b;
};

}  // namespace porthos::mechanics::constraint_detail
