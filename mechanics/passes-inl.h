#pragma once
#include <span>

#include "mechanics/joint_list.h"
#include "mechanics/mechanism.h"

/// The passes over the tree that the algorithms share.
namespace porthos::mechanics::passes {

/// Root → leaf: X_i(q).
template <class T>
void place_bodies(const Mechanism& m, Workspace<T>& w, const T* q) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      w.X[i] = decltype(J)::place(n, q + n.q, n.turn >= 0 ? w.turn_angle[size_t(n.turn)] : T(0.0));
    });
  }
}

/// Leaf → root at one body: eliminates its joint's freedoms from A_i and b_i, one S_k at a time:
///   U = A S,  D = Sᵀ U + rotor inertia,  u = f - Sᵀ b,   A ← A - U D⁻¹ Uᵀ,   b ← b + U D⁻¹ u
/// f: joint momenta (Hamiltonian field) or joint forces (ABA). Without a rotor A S = 0 afterwards; with one it is not.
template <class J, class T>
[[gnu::always_inline]] inline void eliminate(const Node& n, Workspace<T>& w, size_t i, const T* f,
                                             bool root) {
  ArticulatedInertia<T>& A = w.A[i];
  unroll_descending<J::nv>([&](auto k) {
    const size_t j = size_t(n.v) + k;
    Force<T> U = J::template column<k>(n, A);
    if constexpr (J::nv == 6)
      for (int r = k + 1; r < 6; ++r)
        U[r] = T(0.0);  // already eliminated; A keeps no track of those rows
    T D = J::template project<k>(n, U);
    if constexpr (J::nv == 1)
      if (n.rotor_inertia != 0) D = D + T(n.rotor_inertia);
    const T D_inverse = T(1.0) / D;
    const T u = f[j] - J::template project<k>(n, w.b[i]);
    w.U[j] = U, w.D_inverse[j] = D_inverse, w.u[j] = u;
    w.b[i] += (D_inverse * u) * U;
    if constexpr (J::nv == 6)
      A.template subtract_below<k>(U, D_inverse);
    else if (k > 0 || !root)
      A.subtract(U, D_inverse);  // of the world's own inertia nobody asks
  });
  // With all six freedoms gone no inertia is left and b is f itself: set exactly, not to the rounding of it.
  if constexpr (J::nv == 6)
    for (int k = 0; k < 6; ++k) w.b[i][k] = f[size_t(n.v + k)];
}

/// Adds what body i passes on to its parent.
template <class J, class T>
[[gnu::always_inline]] inline void pass_to_parent(const Node& n, Workspace<T>& w, size_t i) {
  const size_t parent = size_t(n.parent);
  if constexpr (J::nv == 6) {
    // nothing is left of A
  } else if (J::frees_rotation_about_z && n.rotor_inertia == 0) {
    w.A[parent] += to_parent_free_about_z(w.X[i], w.A[i]);
  } else {
    w.A[parent] += to_parent(w.X[i], w.A[i]);
  }
  w.b[parent] += w.X[i].to_parent(w.b[i]);
}

/// Root → leaf at one body: the joint rates from the eliminated freedoms and the parent's motion in the body frame;
/// v becomes the body's own motion:  q̇ = D⁻¹ (u - Uᵀ v),  v ← v + S q̇.
template <class J, class T>
[[gnu::always_inline]] inline void back_substitute(const Node& n, const Workspace<T>& w,
                                                   Motion<T>& v, T* rate) {
  unroll<J::nv>([&](auto k) {
    const size_t j = size_t(n.v) + k;
    rate[j] = w.D_inverse[j] * (w.u[j] - dot(v, w.U[j]));
    J::template add<k>(n, rate[j], v);
  });
}

/// The joint's own twist S v.
template <class J, class T>
[[gnu::always_inline]] inline Motion<T> joint_twist(const Node& n, const T* v) {
  Motion<T> s{{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
  unroll<J::nv>([&](auto k) { J::template add<k>(n, v[n.v + k], s); });
  return s;
}

template <class T>
Motion<T> zero_motion() {
  return {{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
}
template <class T>
Force<T> zero_force() {
  return {{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
}

/// Root → leaf: body twists V from joint rates v (w.X must be set).
template <class T>
void twists(const Mechanism& m, Workspace<T>& w, const T* v) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      w.V[i] = joint_twist<decltype(J)>(n, v);
      if (n.parent >= 0) w.V[i] += w.X[i].to_child(w.V[size_t(n.parent)]);
    });
  }
}

/// The momentum or weight of a rigid body, in the scalar T.
template <class T>
RigidInertia<T> rigid(const Node& n) {
  return {T(n.inertia.m), Vec3<T>(n.inertia.mc), Sym3<T>(n.inertia.I)};
}

}  // namespace porthos::mechanics::passes
