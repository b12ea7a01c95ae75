#pragma once
#include "phs/scalars/scalar.h"

/// Spatial algebra (Featherstone 2008, chapter 2). Spatial vectors are [angular; linear].
namespace porthos::mechanics {

/// Every operation here is a few multiplications. A call, with copies of its 9 to 21 numbers, would
/// cost more.
#define PORTHOS_INLINE [[gnu::always_inline]] inline
/// The same for a lambda: placed after its parameters.
#define PORTHOS_INLINE_CALL __attribute__((always_inline))

using phs::abs;
using phs::fma;
using phs::max;
using phs::select;
using phs::sincos;
using phs::sqrt;

/// A vector in 3-space.
template <class T>
struct Vec3 {
  T x, y, z;

  Vec3() = default;
  Vec3(T a, T b, T c) : x(a), y(b), z(c) {}
  template <class S>
  requires(!std::is_same_v<S, T>) explicit Vec3(const Vec3<S>& v) : x(v.x), y(v.y), z(v.z) {}

  PORTHOS_INLINE friend Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  PORTHOS_INLINE friend Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  PORTHOS_INLINE friend Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  PORTHOS_INLINE friend Vec3 operator*(T s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
  PORTHOS_INLINE Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
  PORTHOS_INLINE Vec3& operator-=(const Vec3& b) { return *this = *this - b; }
  T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

/// s a + b
template <class T>
PORTHOS_INLINE Vec3<T> fma(T s, const Vec3<T>& a, const Vec3<T>& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}
/// a·b + c
template <class T>
PORTHOS_INLINE T fma(const Vec3<T>& a, const Vec3<T>& b, T c) {
  return fma(a.x, b.x, fma(a.y, b.y, fma(a.z, b.z, c)));
}
template <class T>
PORTHOS_INLINE T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}
/// a b - c d
template <class T>
PORTHOS_INLINE T product_difference(T a, T b, T c, T d) {
  return fma(a, b, -(c * d));
}
template <class T>
PORTHOS_INLINE Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {product_difference(a.y, b.z, a.z, b.y), product_difference(a.z, b.x, a.x, b.z),
          product_difference(a.x, b.y, a.y, b.x)};
}
/// c + a × b
template <class T>
PORTHOS_INLINE Vec3<T> plus_cross(const Vec3<T>& c, const Vec3<T>& a, const Vec3<T>& b) {
  return {fma(a.y, b.z, fma(-a.z, b.y, c.x)), fma(a.z, b.x, fma(-a.x, b.z, c.y)),
          fma(a.x, b.y, fma(-a.y, b.x, c.z))};
}
template <class T>
PORTHOS_INLINE T norm(const Vec3<T>& a) {
  return sqrt(dot(a, a));
}
/// Whether all three numbers are finite.
inline bool finite(const Vec3<double>& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// A 3x3 matrix by its columns x, y, z. A rotation's columns are the child's axes in the parent.
template <class T>
struct Mat3 {
  Vec3<T> x, y, z;

  Mat3() = default;
  Mat3(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) : x(a), y(b), z(c) {}
  template <class S>
  requires(!std::is_same_v<S, T>) explicit Mat3(const Mat3<S>& m) : x(m.x), y(m.y), z(m.z) {}
  static Mat3 identity() {
    return {{T(1.0), T(0.0), T(0.0)}, {T(0.0), T(1.0), T(0.0)}, {T(0.0), T(0.0), T(1.0)}};
  }

  PORTHOS_INLINE friend Vec3<T> operator*(const Mat3& m, const Vec3<T>& v) {
    return fma(v.x, m.x, fma(v.y, m.y, v.z * m.z));
  }
  /// m v + c
  PORTHOS_INLINE friend Vec3<T> fma(const Mat3& m, const Vec3<T>& v, const Vec3<T>& c) {
    return fma(v.x, m.x, fma(v.y, m.y, fma(v.z, m.z, c)));
  }
  /// mᵀ v
  PORTHOS_INLINE Vec3<T> tmul(const Vec3<T>& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
  PORTHOS_INLINE friend Mat3 operator*(const Mat3& a, const Mat3& b) {
    return {a * b.x, a * b.y, a * b.z};
  }
  PORTHOS_INLINE friend Mat3 operator+(const Mat3& a, const Mat3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  PORTHOS_INLINE friend Mat3 operator-(const Mat3& a, const Mat3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  PORTHOS_INLINE Mat3 transposed() const {
    return {{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}};
  }
};

/// A symmetric 3x3 matrix.
template <class T>
struct Sym3 {
  T xx, xy, xz, yy, yz, zz;

  Sym3() = default;
  Sym3(T a, T b, T c, T d, T e, T f) : xx(a), xy(b), xz(c), yy(d), yz(e), zz(f) {}
  template <class S>
  requires(!std::is_same_v<S, T>) explicit Sym3(const Sym3<S>& m)
      : xx(m.xx), xy(m.xy), xz(m.xz), yy(m.yy), yz(m.yz), zz(m.zz) {}

  PORTHOS_INLINE friend Vec3<T> operator*(const Sym3& m, const Vec3<T>& v) { return m.full() * v; }
  /// m v + c
  PORTHOS_INLINE friend Vec3<T> fma(const Sym3& m, const Vec3<T>& v, const Vec3<T>& c) {
    return fma(m.full(), v, c);
  }
  PORTHOS_INLINE friend Sym3 operator+(const Sym3& a, const Sym3& b) {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
  }
  /// this + a bᵀ, where that is symmetric.
  PORTHOS_INLINE void add_product(const Vec3<T>& a, const Vec3<T>& b) {
    xx = fma(a.x, b.x, xx);
    xy = fma(a.x, b.y, xy);
    xz = fma(a.x, b.z, xz);
    yy = fma(a.y, b.y, yy);
    yz = fma(a.y, b.z, yz);
    zz = fma(a.z, b.z, zz);
  }
  PORTHOS_INLINE Mat3<T> full() const { return {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}; }
};

/// R m Rᵀ for a rotation R with columns x y z. Because R Rᵀ = 1, it equals zz·1 + p xᵀ + x pᵀ + q
/// yᵀ + y qᵀ with p = ½(xx - zz) x + xy y + xz z and q = ½(yy - zz) y + yz z: 35 multiplications
/// instead of 45. In scalars wider than double, R Rᵀ is 1 only to the double rounding of the
/// placements, so there the congruence is computed as it stands, for any R.
template <class T>
PORTHOS_INLINE Sym3<T> rotated(const Mat3<T>& R, const Sym3<T>& m) {
  const Vec3<T>&x = R.x, &y = R.y, &z = R.z;
  if constexpr (phs::is_wide<T>) {
    const Vec3<T> a = m * Vec3<T>{x.x, y.x, z.x};  // columns of m Rᵀ
    const Vec3<T> b = m * Vec3<T>{x.y, y.y, z.y};
    const Vec3<T> c = m * Vec3<T>{x.z, y.z, z.z};
    return {x.x * a.x + y.x * a.y + z.x * a.z, x.x * b.x + y.x * b.y + z.x * b.z,
            x.x * c.x + y.x * c.y + z.x * c.z, x.y * b.x + y.y * b.y + z.y * b.z,
            x.y * c.x + y.y * c.y + z.y * c.z, x.z * c.x + y.z * c.y + z.z * c.z};
  } else {
    const T half(0.5), two(2.0);
    const Vec3<T> p = fma(half * (m.xx - m.zz), x, fma(m.xy, y, m.xz * z));
    const Vec3<T> q = fma(half * (m.yy - m.zz), y, m.yz * z);
    const auto twice = [&](T a, T b, T c, T d)
                           PORTHOS_INLINE_CALL { return fma(two, fma(a, b, c * d), m.zz); };
    const auto mixed = [](T a, T b, T c, T d, T e, T f, T g, T h)
                           PORTHOS_INLINE_CALL { return fma(a, b, fma(c, d, fma(e, f, g * h))); };
    return {twice(p.x, x.x, q.x, y.x),
            mixed(p.x, x.y, p.y, x.x, q.x, y.y, q.y, y.x),
            mixed(p.x, x.z, p.z, x.x, q.x, y.z, q.z, y.x),
            twice(p.y, x.y, q.y, y.y),
            mixed(p.y, x.z, p.z, x.y, q.y, y.z, q.z, y.y),
            twice(p.z, x.z, q.z, y.z)};
  }
}

/// Twist: angular velocity and velocity of the frame origin.
template <class T>
struct Motion {
  Vec3<T> w, v;
  PORTHOS_INLINE friend Motion operator+(const Motion& a, const Motion& b) {
    return {a.w + b.w, a.v + b.v};
  }
  PORTHOS_INLINE friend Motion operator-(const Motion& a, const Motion& b) {
    return {a.w - b.w, a.v - b.v};
  }
  PORTHOS_INLINE Motion& operator+=(const Motion& b) { return *this = *this + b; }
  T& operator[](int i) { return i < 3 ? w[i] : v[i - 3]; }
  const T& operator[](int i) const { return i < 3 ? w[i] : v[i - 3]; }
};

/// Wrench or momentum: moment about the frame origin and force.
template <class T>
struct Force {
  Vec3<T> n, f;
  PORTHOS_INLINE friend Force operator+(const Force& a, const Force& b) {
    return {a.n + b.n, a.f + b.f};
  }
  PORTHOS_INLINE friend Force operator-(const Force& a, const Force& b) {
    return {a.n - b.n, a.f - b.f};
  }
  PORTHOS_INLINE friend Force operator*(T s, const Force& a) { return {s * a.n, s * a.f}; }
  PORTHOS_INLINE Force& operator+=(const Force& b) { return *this = *this + b; }
  PORTHOS_INLINE Force& operator-=(const Force& b) { return *this = *this - b; }
  T& operator[](int i) { return i < 3 ? n[i] : f[i - 3]; }
  const T& operator[](int i) const { return i < 3 ? n[i] : f[i - 3]; }
};

template <class T>
PORTHOS_INLINE T dot(const Motion<T>& v, const Force<T>& f) {
  return dot(v.w, f.n) + dot(v.v, f.f);  // two short sums: the recursions wait for it
}
/// a + s f
template <class T>
PORTHOS_INLINE Force<T> fma(T s, const Force<T>& f, const Force<T>& a) {
  return {fma(s, f.n, a.n), fma(s, f.f, a.f)};
}
/// v × m
template <class T>
PORTHOS_INLINE Motion<T> cross(const Motion<T>& v, const Motion<T>& m) {
  return {cross(v.w, m.w), plus_cross(cross(v.w, m.v), v.v, m.w)};
}
/// v ×* f
template <class T>
PORTHOS_INLINE Force<T> cross(const Motion<T>& v, const Force<T>& f) {
  return {plus_cross(cross(v.w, f.n), v.v, f.f), cross(v.w, f.f)};
}

/// v × S times s for the unit twist S about (axis 0 1 2) or along (3 4 5) x y z; skips the zeros of
/// S.
template <int axis, class T>
PORTHOS_INLINE void add_cross_unit(const Motion<T>& v, T s, Motion<T>& a) {
  const auto add = [s](const Vec3<T>& b, Vec3<T>& c) {  // c += b × e s
    if constexpr (axis % 3 == 0) {
      c.y = fma(b.z, s, c.y);
      c.z = fma(-b.y, s, c.z);
    }
    if constexpr (axis % 3 == 1) {
      c.z = fma(b.x, s, c.z);
      c.x = fma(-b.z, s, c.x);
    }
    if constexpr (axis % 3 == 2) {
      c.x = fma(b.y, s, c.x);
      c.y = fma(-b.x, s, c.y);
    }
  };
  if constexpr (axis < 3) {
    add(v.w, a.w);
    add(v.v, a.v);
  }
  if constexpr (axis >= 3) add(v.w, a.v);
}

/// Pose of a child frame in its parent: rotation child -> parent and origin of the child in the
/// parent.
template <class T>
struct Transform {
  Mat3<T> R;
  Vec3<T> r;

  /// Transforms a twist from the parent's to the child's frame: X v.
  PORTHOS_INLINE Motion<T> to_child(const Motion<T>& m) const {
    return {R.tmul(m.w), R.tmul(plus_cross(m.v, m.w, r))};
  }
  /// Transforms a wrench from the child's to the parent's frame: Xᵀ f.
  PORTHOS_INLINE Force<T> to_parent(const Force<T>& g) const {
    const Vec3<T> f = R * g.f;
    return {plus_cross(R * g.n, r, f), f};
  }
  PORTHOS_INLINE Motion<T> to_parent(const Motion<T>& m) const {
    const Vec3<T> w = R * m.w;
    return {w, plus_cross(R * m.v, r, w)};
  }
  PORTHOS_INLINE Force<T> to_child(const Force<T>& g) const {
    return {R.tmul(plus_cross(g.n, g.f, r)), R.tmul(g.f)};
  }
  PORTHOS_INLINE friend Transform operator*(const Transform& a, const Transform& b) {
    return {a.R * b.R, fma(a.R, b.r, a.r)};
  }
};
/// The same pose in the scalar T.
template <class T, class S>
Transform<T> converted(const Transform<S>& X) {
  return {Mat3<T>(X.R), Vec3<T>(X.r)};
}

}  // namespace porthos::mechanics
