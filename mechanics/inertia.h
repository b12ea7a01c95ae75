#pragma once
#include "mechanics/spatial.h"

/// Inertias of rigid and articulated bodies (Featherstone 2008, chapters 2 and 7).
namespace porthos::mechanics {

/// Inertia of a rigid body: mass, first moment m·c, rotational inertia about the frame origin.
template <class T>
struct RigidInertia {
  T m;
  Vec3<T> mc;
  Sym3<T> I;

  PORTHOS_INLINE Force<T> operator*(const Motion<T>& v) const {
    return {fma(I, v.w, cross(mc, v.v)), fma(m, v.v, cross(v.w, mc))};
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

/// Transforms a rigid inertia from the child's to the parent's frame; 10 numbers instead of 21.
template <class T>
RigidInertia<T> to_parent(const Transform<T>& X, const RigidInertia<T>& c) {
  // I' = R I Rᵀ - r× (R mc)× - (R mc + m r)× r×
  const Vec3<T> mc = X.R * c.mc, s = fma(c.m, X.r, mc), &r = X.r;
  Sym3<T> I = rotated(X.R, c.I);
  const T x = fma(r.x, mc.x, s.x * r.x), y = fma(r.y, mc.y, s.y * r.y),
          z = fma(r.z, mc.z, s.z * r.z);
  I.xx += y + z;
  I.yy += x + z;
  I.zz += x + y;
  I.xy = fma(-r.y, mc.x, fma(-s.y, r.x, I.xy));
  I.xz = fma(-r.z, mc.x, fma(-s.z, r.x, I.xz));
  I.yz = fma(-r.z, mc.y, fma(-s.z, r.y, I.yz));
  return {c.m, s, I};
}

/// Articulated inertia [I H; Hᵀ M]: 21 numbers.
template <class T>
struct ArticulatedInertia {
  Sym3<T> I;
  Mat3<T> H;
  Sym3<T> M;

  ArticulatedInertia() = default;
  template <class S>
  explicit ArticulatedInertia(const RigidInertia<S>& r)
      : I(r.I),
        H({T(0.0), T(r.mc.z), T(-r.mc.y)}, {T(-r.mc.z), T(0.0), T(r.mc.x)},
          {T(r.mc.y), T(-r.mc.x), T(0.0)}),
        M(T(r.m), T(0.0), T(0.0), T(r.m), T(0.0), T(r.m)) {}

  PORTHOS_INLINE Force<T> operator*(const Motion<T>& v) const {
    return {fma(I, v.w, H * v.v), fma(M, v.v, H.tmul(v.w))};
  }
  PORTHOS_INLINE ArticulatedInertia& operator+=(const ArticulatedInertia& b) {
    I = I + b.I;
    H = H + b.H;
    M = M + b.M;
    return *this;
  }
  /// Adds a rigid body; skips its zero entries.
  template <class S>
  PORTHOS_INLINE ArticulatedInertia& operator+=(const RigidInertia<S>& r) {
    const T m(r.m);
    const Vec3<T> mc(r.mc);
    I = I + Sym3<T>(r.I);
    H.x.y += mc.z;
    H.x.z -= mc.y;
    H.y.x -= mc.z;
    H.y.z += mc.x;
    H.z.x += mc.y;
    H.z.y -= mc.x;
    M.xx += m;
    M.yy += m;
    M.zz += m;
    return *this;
  }
  /// A v for an A whose row and column of rotation about z are zero.
  PORTHOS_INLINE Force<T> times_free_about_z(const Motion<T>& v) const {
    const Vec3<T>&w = v.w, &u = v.v;
    const Vec3<T> f = M * u;
    const auto moment = [&](T a, T b, T c, T d, T e) PORTHOS_INLINE_CALL {
      return fma(a, w.x, fma(b, w.y, fma(c, u.x, fma(d, u.y, e * u.z))));
    };
    return {
        {moment(I.xx, I.xy, H.x.x, H.y.x, H.z.x), moment(I.xy, I.yy, H.x.y, H.y.y, H.z.y), T(0.0)},
        {fma(H.x.x, w.x, fma(H.x.y, w.y, f.x)), fma(H.y.x, w.x, fma(H.y.y, w.y, f.y)),
         fma(H.z.x, w.x, fma(H.z.y, w.y, f.z))}};
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
  /// this - K Uᵀ, which is symmetric: K = s U
  PORTHOS_INLINE void subtract(const Force<T>& K, const Force<T>& U) {
    const Force<T> W = T(-1.0) * K;
    I.add_product(W.n, U.n);
    H.x = fma(W.f.x, U.n, H.x);
    H.y = fma(W.f.y, U.n, H.y);
    H.z = fma(W.f.z, U.n, H.z);
    M.add_product(W.f, U.f);
  }
  /// The same, but leaves the row and column of rotation about z unchanged, for callers that do not
  /// use them afterwards.
  PORTHOS_INLINE void subtract_free_about_z(const Force<T>& K, const Force<T>& U) {
    const Force<T> W = T(-1.0) * K;
    I.xx = fma(W.n.x, U.n.x, I.xx);
    I.xy = fma(W.n.x, U.n.y, I.xy);
    I.yy = fma(W.n.y, U.n.y, I.yy);
    H.x.x = fma(W.f.x, U.n.x, H.x.x);
    H.y.x = fma(W.f.y, U.n.x, H.y.x);
    H.z.x = fma(W.f.z, U.n.x, H.z.x);
    H.x.y = fma(W.f.x, U.n.y, H.x.y);
    H.y.y = fma(W.f.y, U.n.y, H.y.y);
    H.z.y = fma(W.f.z, U.n.y, H.z.y);
    M.add_product(W.f, U.f);
  }
  /// this = b but for the row and column of rotation about z, which stay as they are.
  PORTHOS_INLINE void assign_free_about_z(const ArticulatedInertia& b) {
    I.xx = b.I.xx;
    I.xy = b.I.xy;
    I.yy = b.I.yy;
    H.x.x = b.H.x.x;
    H.y.x = b.H.y.x;
    H.z.x = b.H.z.x;
    H.x.y = b.H.x.y;
    H.y.y = b.H.y.y;
    H.z.y = b.H.z.y;
    M = b.M;
  }
  /// The same for callers that use only rows and columns below k afterwards.
  template <int k>
  PORTHOS_INLINE void subtract_below(const Force<T>& K, const Force<T>& U) {
    const Force<T> W = T(-1.0) * K;
    if constexpr (k > 0) I.xx = fma(W.n.x, U.n.x, I.xx);
    if constexpr (k > 1) {
      I.xy = fma(W.n.x, U.n.y, I.xy);
      I.yy = fma(W.n.y, U.n.y, I.yy);
    }
    if constexpr (k > 2) {
      I.xz = fma(W.n.x, U.n.z, I.xz);
      I.yz = fma(W.n.y, U.n.z, I.yz);
      I.zz = fma(W.n.z, U.n.z, I.zz);
    }
    if constexpr (k > 3) {
      H.x = fma(W.f.x, U.n, H.x);
      M.xx = fma(W.f.x, U.f.x, M.xx);
    }
    if constexpr (k > 4) {
      H.y = fma(W.f.y, U.n, H.y);
      M.xy = fma(W.f.x, U.f.y, M.xy);
      M.yy = fma(W.f.y, U.f.y, M.yy);
    }
  }
};

/// Adds the off-origin terms after a rotation: the inertia in a frame in which the old origin is at
/// r.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> translated(const Vec3<T>& r, const Sym3<T>& I,
                                                const Mat3<T>& H, const Sym3<T>& M) {
  // H' = H + r×M,  I' = I - H r× + r× H'ᵀ
  ArticulatedInertia<T> a;
  a.M = M;
  const Mat3<T> m = M.full();
  a.H = {plus_cross(H.x, r, m.x), plus_cross(H.y, r, m.y), plus_cross(H.z, r, m.z)};
  // -H r× : row i is r × (row i of H);   r× H'ᵀ : column j is r × (row j of H')
  const Mat3<T> h = H.transposed(), g = a.H.transposed();
  const Vec3<T> x = plus_cross({I.xx, I.xy, I.xz}, r, h.x),
                y = plus_cross({I.xy, I.yy, I.yz}, r, h.y),
                z = plus_cross({I.xz, I.yz, I.zz}, r, h.z);
  const auto add = [](T c, T u, T v, T w, T q) PORTHOS_INLINE_CALL {  // c + u v - w q
    return fma(u, v, fma(-w, q, c));
  };
  a.I = {add(x.x, r.y, g.x.z, r.z, g.x.y), add(x.y, r.y, g.y.z, r.z, g.y.y),
         add(x.z, r.y, g.z.z, r.z, g.z.y), add(y.y, r.z, g.y.x, r.x, g.y.z),
         add(y.z, r.z, g.z.x, r.x, g.z.z), add(z.z, r.x, g.z.y, r.y, g.z.x)};
  return a;
}

/// Xᵀ A X: transforms an articulated inertia from the child's to the parent's frame.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> to_parent(const Transform<T>& X,
                                               const ArticulatedInertia<T>& A) {
  return translated(X.r, rotated(X.R, A.I), X.R * A.H * X.R.transposed(), rotated(X.R, A.M));
}

/// The same for an A whose row and column of rotation about z are zero, as after the elimination of
/// a revolute joint.
template <class T>
PORTHOS_INLINE ArticulatedInertia<T> to_parent_free_about_z(const Transform<T>& X,
                                                            const ArticulatedInertia<T>& A) {
  const Mat3<T>& R = X.R;
  const Vec3<T>&x = R.x, &y = R.y;
  const Vec3<T> a = fma(A.I.xx, x, A.I.xy * y), b = fma(A.I.xy, x, A.I.yy * y);
  const auto two = [](T c, T d, T e, T f) PORTHOS_INLINE_CALL { return fma(c, d, e * f); };
  const Sym3<T> I{two(a.x, x.x, b.x, y.x), two(a.x, x.y, b.x, y.y), two(a.x, x.z, b.x, y.z),
                  two(a.y, x.y, b.y, y.y), two(a.y, x.z, b.y, y.z), two(a.z, x.z, b.z, y.z)};
  const Vec3<T> t0 = R * Vec3<T>{A.H.x.x, A.H.y.x, A.H.z.x},
                t1 = R * Vec3<T>{A.H.x.y, A.H.y.y, A.H.z.y};
  const Mat3<T> H{fma(t0.x, x, t1.x * y), fma(t0.y, x, t1.y * y), fma(t0.z, x, t1.z * y)};
  return translated(X.r, I, H, rotated(R, A.M));
}

}  // namespace porthos::mechanics
