#pragma once
#include "phs/scalar.h"

/// Spatial algebra (Featherstone 2008, chapter 2). Spatial vectors are [angular; linear].
namespace porthos::mechanics {

/// Every operation here is a handful of multiplications: a call, and the copies of its 9 to 21
/// numbers, would cost more.
#define PORTHOS_INLINE [[gnu::always_inline]] inline

using phs::abs;
using phs::max;
using phs::select;
using phs::sincos;
using phs::sqrt;

/// A vector of 3-space.
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

template <class T>
PORTHOS_INLINE T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
PORTHOS_INLINE Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
PORTHOS_INLINE T norm(const Vec3<T>& a) {
  return sqrt(dot(a, a));
}
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
    return {m.x.x * v.x + m.y.x * v.y + m.z.x * v.z, m.x.y * v.x + m.y.y * v.y + m.z.y * v.z,
            m.x.z * v.x + m.y.z * v.y + m.z.z * v.z};
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

  PORTHOS_INLINE friend Vec3<T> operator*(const Sym3& m, const Vec3<T>& v) {
    return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
            m.xz * v.x + m.yz * v.y + m.zz * v.z};
  }
  PORTHOS_INLINE friend Sym3 operator+(const Sym3& a, const Sym3& b) {
    return {a.xx + b.xx, a.xy + b.xy, a.xz + b.xz, a.yy + b.yy, a.yz + b.yz, a.zz + b.zz};
  }
  PORTHOS_INLINE Mat3<T> full() const { return {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}; }
};

/// R m Rᵀ for a rotation R with columns x y z. As R Rᵀ = 1 it is zz·1 + p xᵀ + x pᵀ + q yᵀ + y qᵀ
/// with p = ½(xx - zz) x + xy y + xz z and q = ½(yy - zz) y + yz z: 35 multiplications instead of
/// 45. In wider numbers than those the placements were given in, R Rᵀ is 1 only to the rounding of
/// these: there it is the congruence, whatever R is.
template <class T>
PORTHOS_INLINE Sym3<T> rotated(const Mat3<T>& R, const Sym3<T>& m) {
  const Vec3<T>&x = R.x, &y = R.y, &z = R.z;
  if constexpr (phs::is_real<T> && !std::is_same_v<T, double>) {
    const Vec3<T> a = m * Vec3<T>{x.x, y.x, z.x};  // columns of m Rᵀ
    const Vec3<T> b = m * Vec3<T>{x.y, y.y, z.y};
    const Vec3<T> c = m * Vec3<T>{x.z, y.z, z.z};
    return {x.x * a.x + y.x * a.y + z.x * a.z, x.x * b.x + y.x * b.y + z.x * b.z,
            x.x * c.x + y.x * c.y + z.x * c.z, x.y * b.x + y.y * b.y + z.y * b.z,
            x.y * c.x + y.y * c.y + z.y * c.z, x.z * c.x + y.z * c.y + z.z * c.z};
  } else {
    const T half(0.5);
    const Vec3<T> p = (half * (m.xx - m.zz)) * x + m.xy * y + m.xz * z;
    const Vec3<T> q = (half * (m.yy - m.zz)) * y + m.yz * z;
    const T a = p.x * x.x + q.x * y.x, b = p.y * x.y + q.y * y.y, c = p.z * x.z + q.z * y.z;
    return {m.zz + (a + a),
            p.x * x.y + p.y * x.x + (q.x * y.y + q.y * y.x),
            p.x * x.z + p.z * x.x + (q.x * y.z + q.z * y.x),
            m.zz + (b + b),
            p.y * x.z + p.z * x.y + (q.y * y.z + q.z * y.y),
            m.zz + (c + c)};
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
  return dot(v.w, f.n) + dot(v.v, f.f);
}
/// v × m
template <class T>
PORTHOS_INLINE Motion<T> cross(const Motion<T>& v, const Motion<T>& m) {
  return {cross(v.w, m.w), cross(v.w, m.v) + cross(v.v, m.w)};
}
/// v ×* f
template <class T>
PORTHOS_INLINE Force<T> cross(const Motion<T>& v, const Force<T>& f) {
  return {cross(v.w, f.n) + cross(v.v, f.f), cross(v.w, f.f)};
}

/// v × S for the unit twist S about (axis 0 1 2) or along (3 4 5) x y z, times s; its zeros are not
/// computed.
template <int axis, class T>
PORTHOS_INLINE void add_cross_unit(const Motion<T>& v, T s, Motion<T>& a) {
  const auto add = [s](const Vec3<T>& b, Vec3<T>& c) {  // c += b × e s
    if constexpr (axis % 3 == 0) c.y += b.z * s, c.z -= b.y * s;
    if constexpr (axis % 3 == 1) c.z += b.x * s, c.x -= b.z * s;
    if constexpr (axis % 3 == 2) c.x += b.y * s, c.y -= b.x * s;
  };
  if constexpr (axis < 3) add(v.w, a.w), add(v.v, a.v);
  if constexpr (axis >= 3) add(v.w, a.v);
}

/// Pose of a child frame in its parent: rotation child -> parent and origin of the child in the
/// parent.
template <class T>
struct Transform {
  Mat3<T> R;
  Vec3<T> r;

  /// A twist from the parent's to the child's frame: X v.
  PORTHOS_INLINE Motion<T> to_child(const Motion<T>& m) const {
    return {R.tmul(m.w), R.tmul(m.v + cross(m.w, r))};
  }
  /// A wrench from the child's to the parent's frame: Xᵀ f.
  PORTHOS_INLINE Force<T> to_parent(const Force<T>& g) const {
    const Vec3<T> f = R * g.f;
    return {R * g.n + cross(r, f), f};
  }
  PORTHOS_INLINE Motion<T> to_parent(const Motion<T>& m) const {
    const Vec3<T> w = R * m.w;
    return {w, R * m.v + cross(r, w)};
  }
  PORTHOS_INLINE Force<T> to_child(const Force<T>& g) const {
    return {R.tmul(g.n - cross(r, g.f)), R.tmul(g.f)};
  }
  PORTHOS_INLINE friend Transform operator*(const Transform& a, const Transform& b) {
    return {a.R * b.R, a.r + a.R * b.r};
  }
};

/// Inertia of a rigid body: mass, first moment m·c, rotational inertia about the frame origin.
template <class T>
struct RigidInertia {
  T m;
  Vec3<T> mc;
  Sym3<T> I;

  PORTHOS_INLINE Force<T> operator*(const Motion<T>& v) const {
    return {I * v.w + cross(mc, v.v), m * v.v - cross(mc, v.w)};
  }
  /// Column k, i.e. the product with the k-th unit twist.
  template <int k>
  PORTHOS_INLINE Force<T> column() const {
    const T o(0.0);
    if constexpr (k == 0) return {{I.xx, I.xy, I.xz}, {o, -mc.z, mc.y}};
    if constexpr (k == 1) return {{I.xy, I.yy, I.yz}, {mc.z, o, -mc.x}};
    if constexpr (k == 2) return {{I.xz, I.yz, I.zz}, {-mc.y, mc.x, o}};
    if constexpr (k == 3) return {{o, mc.z, -mc.y}, {m, o, o}};
    if constexpr (k == 4) return {{-mc.z, o, mc.x}, {o, m, o}};
    if constexpr (k == 5) return {{mc.y, -mc.x, o}, {o, o, m}};
  }
};

/// Articulated inertia [I H; Hᵀ M]: 21 numbers.
template <class T>
struct ArticulatedInertia {
  Sym3<T> I;
  Mat3<T> H;
  Sym3<T> M;

  ArticulatedInertia() = default;
  explicit ArticulatedInertia(const RigidInertia<double>& r)
      : I(r.I),
        H({T(0.0), T(r.mc.z), T(-r.mc.y)}, {T(-r.mc.z), T(0.0), T(r.mc.x)},
          {T(r.mc.y), T(-r.mc.x), T(0.0)}),
        M(T(r.m), T(0.0), T(0.0), T(r.m), T(0.0), T(r.m)) {}

  PORTHOS_INLINE Force<T> operator*(const Motion<T>& v) const {
    return {I * v.w + H * v.v, H.tmul(v.w) + M * v.v};
  }
  PORTHOS_INLINE ArticulatedInertia& operator+=(const ArticulatedInertia& b) {
    I = I + b.I, H = H + b.H, M = M + b.M;
    return *this;
  }
  /// Adds a rigid body; its zeros are not added.
  PORTHOS_INLINE ArticulatedInertia& operator+=(const RigidInertia<double>& r) {
    const T m(r.m);
    const Vec3<T> mc(r.mc);
    I = I + Sym3<T>(r.I);
    H.x.y += mc.z, H.x.z -= mc.y, H.y.x -= mc.z, H.y.z += mc.x, H.z.x += mc.y, H.z.y -= mc.x;
    M.xx += m, M.yy += m, M.zz += m;
    return *this;
  }
  /// A v where row and column of rotation about z are zero.
  PORTHOS_INLINE Force<T> times_free_about_z(const Motion<T>& v) const {
    const Vec3<T>&w = v.w, &u = v.v;
    return {{I.xx * w.x + I.xy * w.y + (H.x.x * u.x + H.y.x * u.y + H.z.x * u.z),
             I.xy * w.x + I.yy * w.y + (H.x.y * u.x + H.y.y * u.y + H.z.y * u.z), T(0.0)},
            {H.x.x * w.x + H.x.y * w.y + (M.xx * u.x + M.xy * u.y + M.xz * u.z),
             H.y.x * w.x + H.y.y * w.y + (M.xy * u.x + M.yy * u.y + M.yz * u.z),
             H.z.x * w.x + H.z.y * w.y + (M.xz * u.x + M.yz * u.y + M.zz * u.z)}};
  }
  /// Column k, i.e. the product with the k-th unit twist.
  template <int k>
  PORTHOS_INLINE Force<T> column() const {
    if constexpr (k == 0) return {{I.xx, I.xy, I.xz}, {H.x.x, H.y.x, H.z.x}};
    if constexpr (k == 1) return {{I.xy, I.yy, I.yz}, {H.x.y, H.y.y, H.z.y}};
    if constexpr (k == 2) return {{I.xz, I.yz, I.zz}, {H.x.z, H.y.z, H.z.z}};
    if constexpr (k == 3) return {H.x, {M.xx, M.xy, M.xz}};
    if constexpr (k == 4) return {H.y, {M.xy, M.yy, M.yz}};
    if constexpr (k == 5) return {H.z, {M.xz, M.yz, M.zz}};
  }
  /// this - s·U Uᵀ
  PORTHOS_INLINE void subtract(const Force<T>& U, T s) {
    const Force<T> W = s * U;
    I.xx -= W.n.x * U.n.x, I.xy -= W.n.x * U.n.y, I.xz -= W.n.x * U.n.z;
    I.yy -= W.n.y * U.n.y, I.yz -= W.n.y * U.n.z, I.zz -= W.n.z * U.n.z;
    H.x -= W.f.x * U.n, H.y -= W.f.y * U.n, H.z -= W.f.z * U.n;
    M.xx -= W.f.x * U.f.x, M.xy -= W.f.x * U.f.y, M.xz -= W.f.x * U.f.z;
    M.yy -= W.f.y * U.f.y, M.yz -= W.f.y * U.f.z, M.zz -= W.f.z * U.f.z;
  }
  /// The same where nobody asks for row and column of rotation about z afterwards: they are left as
  /// they were.
  PORTHOS_INLINE void subtract_free_about_z(const Force<T>& U, T s) {
    const Force<T> W = s * U;
    I.xx -= W.n.x * U.n.x, I.xy -= W.n.x * U.n.y, I.yy -= W.n.y * U.n.y;
    H.x.x -= W.f.x * U.n.x, H.y.x -= W.f.y * U.n.x, H.z.x -= W.f.z * U.n.x;
    H.x.y -= W.f.x * U.n.y, H.y.y -= W.f.y * U.n.y, H.z.y -= W.f.z * U.n.y;
    M.xx -= W.f.x * U.f.x, M.xy -= W.f.x * U.f.y, M.xz -= W.f.x * U.f.z;
    M.yy -= W.f.y * U.f.y, M.yz -= W.f.y * U.f.z, M.zz -= W.f.z * U.f.z;
  }
  /// The same where only rows and columns below k are asked for afterwards.
  template <int k>
  PORTHOS_INLINE void subtract_below(const Force<T>& U, T s) {
    const Force<T> W = s * U;
    if constexpr (k > 0) I.xx -= W.n.x * U.n.x;
    if constexpr (k > 1) I.xy -= W.n.x * U.n.y, I.yy -= W.n.y * U.n.y;
    if constexpr (k > 2) I.xz -= W.n.x * U.n.z, I.yz -= W.n.y * U.n.z, I.zz -= W.n.z * U.n.z;
    if constexpr (k > 3) H.x -= W.f.x * U.n, M.xx -= W.f.x * U.f.x;
    if constexpr (k > 4) H.y -= W.f.y * U.n, M.xy -= W.f.x * U.f.y, M.yy -= W.f.y * U.f.y;
  }
};

/// Adds the off-origin terms after a rotation: the inertia seen from a frame from which its own
/// origin lies at r.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> translated(const Vec3<T>& r, const Sym3<T>& I,
                                                const Mat3<T>& H, const Sym3<T>& M) {
  // H' = H + r×M,  I' = I - H r× + r× H'ᵀ
  ArticulatedInertia<T> a;
  a.M = M;
  const Mat3<T> m = M.full();
  a.H = H + Mat3<T>{cross(r, m.x), cross(r, m.y), cross(r, m.z)};
  const Mat3<T>& G = a.H;
  // -H r× : row i is r × (row i of H);   r× H'ᵀ : column j is r × (row j of H')
  const Vec3<T> h0{H.x.x, H.y.x, H.z.x}, h1{H.x.y, H.y.y, H.z.y}, h2{H.x.z, H.y.z, H.z.z};
  const Vec3<T> g0{G.x.x, G.y.x, G.z.x}, g1{G.x.y, G.y.y, G.z.y}, g2{G.x.z, G.y.z, G.z.z};
  a.I.xx = I.xx + (r.y * h0.z - r.z * h0.y) + (r.y * g0.z - r.z * g0.y);
  a.I.xy = I.xy + (r.z * h0.x - r.x * h0.z) + (r.y * g1.z - r.z * g1.y);
  a.I.xz = I.xz + (r.x * h0.y - r.y * h0.x) + (r.y * g2.z - r.z * g2.y);
  a.I.yy = I.yy + (r.z * h1.x - r.x * h1.z) + (r.z * g1.x - r.x * g1.z);
  a.I.yz = I.yz + (r.x * h1.y - r.y * h1.x) + (r.z * g2.x - r.x * g2.z);
  a.I.zz = I.zz + (r.x * h2.y - r.y * h2.x) + (r.x * g2.y - r.y * g2.x);
  return a;
}

/// Xᵀ A X: an articulated inertia from the child's to the parent's frame.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> to_parent(const Transform<T>& X,
                                               const ArticulatedInertia<T>& A) {
  return translated(X.r, rotated(X.R, A.I), X.R * A.H * X.R.transposed(), rotated(X.R, A.M));
}

/// The same for an A whose row and column of rotation about z are zero, as a revolute joint leaves
/// it.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> to_parent_free_about_z(const Transform<T>& X,
                                                            const ArticulatedInertia<T>& A) {
  const Mat3<T>& R = X.R;
  const Vec3<T> a = A.I.xx * R.x + A.I.xy * R.y, b = A.I.xy * R.x + A.I.yy * R.y;
  const Sym3<T> I{a.x * R.x.x + b.x * R.y.x, a.x * R.x.y + b.x * R.y.y, a.x * R.x.z + b.x * R.y.z,
                  a.y * R.x.y + b.y * R.y.y, a.y * R.x.z + b.y * R.y.z, a.z * R.x.z + b.z * R.y.z};
  const Vec3<T> t0 = R * Vec3<T>{A.H.x.x, A.H.y.x, A.H.z.x},
                t1 = R * Vec3<T>{A.H.x.y, A.H.y.y, A.H.z.y};
  const Mat3<T> H{t0.x * R.x + t1.x * R.y, t0.y * R.x + t1.y * R.y, t0.z * R.x + t1.z * R.y};
  return translated(X.r, I, H, rotated(R, A.M));
}

}  // namespace porthos::mechanics
