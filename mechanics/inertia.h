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
    I = I + b.I;
    H = H + b.H;
    M = M + b.M;
    return *this;
  }
  /// Adds a rigid body; skips its zero entries.
  PORTHOS_INLINE ArticulatedInertia& operator+=(const RigidInertia<double>& r) {
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
    I.xx -= W.n.x * U.n.x;
    I.xy -= W.n.x * U.n.y;
    I.xz -= W.n.x * U.n.z;
    I.yy -= W.n.y * U.n.y;
    I.yz -= W.n.y * U.n.z;
    I.zz -= W.n.z * U.n.z;
    H.x -= W.f.x * U.n;
    H.y -= W.f.y * U.n;
    H.z -= W.f.z * U.n;
    M.xx -= W.f.x * U.f.x;
    M.xy -= W.f.x * U.f.y;
    M.xz -= W.f.x * U.f.z;
    M.yy -= W.f.y * U.f.y;
    M.yz -= W.f.y * U.f.z;
    M.zz -= W.f.z * U.f.z;
  }
  /// The same, but leaves the row and column of rotation about z unchanged, for callers that do not
  /// use them afterwards.
  PORTHOS_INLINE void subtract_free_about_z(const Force<T>& U, T s) {
    const Force<T> W = s * U;
    I.xx -= W.n.x * U.n.x;
    I.xy -= W.n.x * U.n.y;
    I.yy -= W.n.y * U.n.y;
    H.x.x -= W.f.x * U.n.x;
    H.y.x -= W.f.y * U.n.x;
    H.z.x -= W.f.z * U.n.x;
    H.x.y -= W.f.x * U.n.y;
    H.y.y -= W.f.y * U.n.y;
    H.z.y -= W.f.z * U.n.y;
    M.xx -= W.f.x * U.f.x;
    M.xy -= W.f.x * U.f.y;
    M.xz -= W.f.x * U.f.z;
    M.yy -= W.f.y * U.f.y;
    M.yz -= W.f.y * U.f.z;
    M.zz -= W.f.z * U.f.z;
  }
  /// The same for callers that use only rows and columns below k afterwards.
  template <int k>
  PORTHOS_INLINE void subtract_below(const Force<T>& U, T s) {
    const Force<T> W = s * U;
    if constexpr (k > 0) I.xx -= W.n.x * U.n.x;
    if constexpr (k > 1) {
      I.xy -= W.n.x * U.n.y;
      I.yy -= W.n.y * U.n.y;
    }
    if constexpr (k > 2) {
      I.xz -= W.n.x * U.n.z;
      I.yz -= W.n.y * U.n.z;
      I.zz -= W.n.z * U.n.z;
    }
    if constexpr (k > 3) {
      H.x -= W.f.x * U.n;
      M.xx -= W.f.x * U.f.x;
    }
    if constexpr (k > 4) {
      H.y -= W.f.y * U.n;
      M.xy -= W.f.x * U.f.y;
      M.yy -= W.f.y * U.f.y;
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
  const Vec3<T> a = A.I.xx * R.x + A.I.xy * R.y, b = A.I.xy * R.x + A.I.yy * R.y;
  const Sym3<T> I{a.x * R.x.x + b.x * R.y.x, a.x * R.x.y + b.x * R.y.y, a.x * R.x.z + b.x * R.y.z,
                  a.y * R.x.y + b.y * R.y.y, a.y * R.x.z + b.y * R.y.z, a.z * R.x.z + b.z * R.y.z};
  const Vec3<T> t0 = R * Vec3<T>{A.H.x.x, A.H.y.x, A.H.z.x},
                t1 = R * Vec3<T>{A.H.x.y, A.H.y.y, A.H.z.y};
  const Mat3<T> H{t0.x * R.x + t1.x * R.y, t0.y * R.x + t1.y * R.y, t0.z * R.x + t1.z * R.y};
  return translated(X.r, I, H, rotated(R, A.M));
}

}  // namespace porthos::mechanics
