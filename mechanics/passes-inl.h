#pragma once
#include <cassert>
#include <span>

#include "mechanics/placement-inl.h"

/// The passes over the tree that the algorithms share.
namespace porthos::mechanics::passes {

/// Size check for the kernels' assertions; compiled out where assertions are off.
template <class A>
bool sized(const A& array, size_t n) {
  return array.size() == n;
}
template <class A>
bool sized_or_none(const A& array, size_t n) {
  return array.empty() || array.size() == n;
}
/// Whether q and the workspace fit the mechanism.
template <class T>
bool fits(const Mechanism& m, const Workspace<T>& w, std::span<const T> q) {
  return sized(q, size_t(m.nq())) && sized(w.X, m.nodes().size());
}

/// Joint J of bodies without rotors, which the compiler then knows.
template <class J>
struct WithoutRotor : J {
  static constexpr bool may_have_rotor = false;
};
template <class J>
bool has_rotor(const Node& n) {
  if constexpr (J::nv != 1 || requires { J::may_have_rotor; })
    return false;
  else
    return n.rotor_inertia != 0;
}

/// Whether the elimination of the joint zeroes the row and column of rotation about z.
template <class J>
bool freed_about_z(const Node& n) {
  return J::frees_rotation_about_z && !has_rotor<J>(n);
}

/// Whether body i goes on with the run of body i - 1, which carries it: bodies of one joint type,
/// all with rotors or all without. What they pass on stays in registers; bodies are in depth-first
/// order, so the workspace takes only what runs pass to each other.
inline bool in_run(const std::vector<Node>& nodes, size_t i) {
  if (i == nodes.size()) return false;
  const Node& n = nodes[i];
  if (n.parent < 0 || size_t(n.parent) + 1 != i) return false;
  const Node& before = nodes[i - 1];
  return n.type == before.type && (n.rotor_inertia == 0) == (before.rotor_inertia == 0);
}
/// f(J, i) in a function of its own, so that a run has all registers to itself.
template <class J, class F>
[[gnu::noinline]] size_t take_run(F& f, size_t i) {
  return f(J{}, i);
}
/// The same for the joint of body n.
template <class F>
[[gnu::always_inline]] inline size_t take_run(const Node& n, F& f, size_t i) {
  visit_joint(n.type, [&](auto J) {
    using Joint = decltype(J);
    if constexpr (Joint::frees_rotation_about_z)
      if (n.rotor_inertia == 0) return void(i = take_run<WithoutRotor<Joint>>(f, i));
    i = take_run<Joint>(f, i);
  });
  return i;
}
/// Root → leaf: f(J, i) takes the run that begins with body i and returns the body after its last.
template <class F>
void runs_down(const Mechanism& m, F&& f) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size();) i = take_run(nodes[i], f, i);
}
/// Leaf → root: f(J, i) takes the run that ends before body i and returns its first.
template <class F>
void runs_up(const Mechanism& m, F&& f) {
  const auto& nodes = m.nodes();
  for (size_t i = nodes.size(); i > 0;) i = take_run(nodes[i - 1], f, i);
}

template <class T>
inline constexpr bool inertias_change = requires(Workspace<T> w) {
  w.inertia_change;
};

/// x + ε dx
template <class T>
T with_change(double x, double dx) {
  T sum(x);
  sum.d = sum.d + decltype(sum.d)(dx);
  return sum;
}
/// The inertia of body i; in duals with its change.
template <class T>
[[gnu::always_inline]] inline decltype(auto) own_inertia(const Node& n,
                                                         [[maybe_unused]] const Workspace<T>& w,
                                                         [[maybe_unused]] size_t i) {
  if constexpr (inertias_change<T>) {
    RigidInertia<double> d{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
    if (!w.inertia_change.empty()) d = w.inertia_change[i];
    const auto& [m, c, I] = n.inertia;
    const auto of = [](double x, double dx) { return with_change<T>(x, dx); };
    return RigidInertia<T>{of(m, d.m),
                           {of(c.x, d.mc.x), of(c.y, d.mc.y), of(c.z, d.mc.z)},
                           {of(I.xx, d.I.xx), of(I.xy, d.I.xy), of(I.xz, d.I.xz), of(I.yy, d.I.yy),
                            of(I.yz, d.I.yz), of(I.zz, d.I.zz)}};
  } else {
    return (n.inertia);
  }
}
/// The mass of a body and all that it carries, in the scalar T.
template <class T>
T subtree_mass(const Node& n, [[maybe_unused]] const Workspace<T>& w, [[maybe_unused]] size_t i) {
  if constexpr (inertias_change<T>)
    return with_change<T>(n.subtree_mass,
                          w.subtree_mass_change.empty() ? 0 : w.subtree_mass_change[i]);
  else
    return phs::is_wide<T> ? T(n.subtree_mass) + T(n.subtree_mass_low) : T(n.subtree_mass);
}

/// The articulated inertia of the last body of a run before its joint is eliminated, its own plus
/// the contributions of its children.
template <class T>
[[gnu::always_inline]] inline ArticulatedInertia<T> collected(const Node& n, const Workspace<T>& w,
                                                              size_t i) {
  if (n.leaf) return ArticulatedInertia<T>(own_inertia(n, w, i));
  return w.A[i];
}

template <class T>
[[gnu::always_inline]] inline T rotor_inertia(const Node& n,
                                              [[maybe_unused]] const Workspace<T>& w) {
  if constexpr (inertias_change<T>)
    return with_change<T>(n.rotor_inertia,
                          w.rotor_inertia_change.empty() ? 0 : w.rotor_inertia_change[size_t(n.v)]);
  else
    return T(n.rotor_inertia);
}

/// Leaf → root, one body: eliminates its joint's freedoms from A_i and b_i, one S_k at a time:
///   U = A S,  D = Sᵀ U + rotor inertia,  K = U D⁻¹,  u = f - Sᵀ b,   A ← A - K Uᵀ,   b ← b + K u
/// f: joint momenta (Hamiltonian field) or joint forces (ABA). Afterwards A S = 0, except with a
/// rotor. The way down uses the same rounded K, and Sᵀ K is exactly 1 where A S is exactly 0. So
/// the recursion is Hamiltonian for each rounded K. (With U and D⁻¹ apart, the rounding of D⁻¹ at
/// a leaf, where D is constant, does work that always has the same sign while the joint turns the
/// same way.)
template <class J, class T>
[[gnu::always_inline]] inline void eliminate(const Node& n, Workspace<T>& w, const T* f, bool root,
                                             ArticulatedInertia<T>& A, Force<T>& b) {
  unroll_descending<J::nv>([&](auto k) PORTHOS_INLINE_CALL {
    const size_t j = size_t(n.v) + k;
    Force<T> U = J::template column<k>(n, A);
    if constexpr (J::nv == 6)
      for (int r = k + 1; r < 6; ++r)
        U[r] = T(0.0);  // already eliminated; A does not update those rows
    T D = J::template project<k>(n, U);
    if constexpr (J::nv == 1)
      if (has_rotor<J>(n)) D = D + rotor_inertia(n, w);
    const T D_inverse = T(1.0) / D;
    const T u = f[j] - J::template project<k>(n, b);
    Force<T> K = D_inverse * U;
    if constexpr (requires { J::axis; })
      if (!has_rotor<J>(n)) K[J::axis[size_t(k)]] = T(1.0);
    w.K[j] = K;
    w.D_inverse[j] = D_inverse;
    w.u[j] = u;
    b = fma(u, K, b);
    if constexpr (J::nv == 6)
      A.template subtract_below<k>(K, U);
    else if (k == 0 && root)
      return;  // the inertia passed to the world is never used
    else if (freed_about_z<J>(n))
      A.subtract_free_about_z(K, U);
    else
      A.subtract(K, U);
  });
  // After the elimination of all six freedoms no inertia remains and b equals f. Set it exactly,
  // without rounding.
  if constexpr (J::nv == 6)
    for (int k = 0; k < 6; ++k) b[k] = f[size_t(n.v + k)];
}

/// The inertia that `eliminate` left, in the parent's frame.
template <class J, class T>
[[gnu::always_inline]] inline ArticulatedInertia<T> left_in_parent(const Node& n,
                                                                   const Workspace<T>& w, size_t i,
                                                                   const ArticulatedInertia<T>& A) {
  const bool free = freed_about_z<J>(n);
  if constexpr (J::about_z) {
    if (n.axial) {
      ArticulatedInertia<T> B = A;
      if (free)
        climb<J, true>(n, w.screw[i], B);
      else
        climb<J, false>(n, w.screw[i], B);
      return B;
    }
  }
  return free ? to_parent_free_about_z(w.X[i], A) : mechanics::to_parent(w.X[i], A);
}

/// A: of body i, as `eliminate` left it, becomes that of its parent: with the parent's own, which
/// the first child adds, and with what the other children have passed.
template <class J, class T>
[[gnu::always_inline]] inline void pass_to_parent(const Mechanism& m, const Node& n,
                                                  const Workspace<T>& w, size_t i,
                                                  ArticulatedInertia<T>& A) {
  const size_t parent = size_t(n.parent);
  decltype(auto) own = own_inertia(m.nodes()[parent], w, parent);
  if constexpr (J::nv == 6) {  // the remaining A is zero
    A = n.last_child ? ArticulatedInertia<T>(own) : w.A[parent];
  } else {
    A = left_in_parent<J>(n, w, i, A);
    if (n.last_child)
      A += own;
    else
      A += w.A[parent];
  }
}

/// Root → leaf, one body: joint rates from the eliminated freedoms and the parent's motion v in the
/// body frame. v becomes the body's own motion:  q̇ = D⁻¹ u - Kᵀ v,  v ← v + S q̇.
template <class J, class T>
[[gnu::always_inline]] inline void back_substitute(const Node& n, const Workspace<T>& w,
                                                   Motion<T>& v, T* rate) {
  unroll<J::nv>([&](auto k) {
    const size_t j = size_t(n.v) + k;
    rate[j] = fma(w.D_inverse[j], w.u[j], -dot(v, w.K[j]));
    J::template add<k>(n, rate[j], v);
  });
}

/// Keeps for the way down what `eliminate` left of A.
template <class J, class T>
[[gnu::always_inline]] inline void keep_left(const Node& n, const ArticulatedInertia<T>& A,
                                             ArticulatedInertia<T>& to) {
  if (freed_about_z<J>(n))
    to.assign_free_about_z(A);
  else
    to = A;
}
/// A v with the A that `eliminate` left.
template <class J, class T>
[[gnu::always_inline]] inline Force<T> left_times(const Node& n, const ArticulatedInertia<T>& A,
                                                  const Motion<T>& v) {
  return freed_about_z<J>(n) ? A.times_free_about_z(v) : A * v;
}

/// The joint's own twist S v.
template <class J, class T>
[[gnu::always_inline]] inline Motion<T> joint_twist(const Node& n, const T* v) {
  Motion<T> s{{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
  unroll<J::nv>([&](auto k) { J::template add<k>(n, v[n.v + k], s); });
  return s;
}

/// v += S rates.
template <class J, class T>
[[gnu::always_inline]] inline void add_joint_twist(const Node& n, const T* rates, Motion<T>& v) {
  unroll<J::nv>([&](auto k) { J::template add<k>(n, rates[n.v + k], v); });
}

/// a += V × S rates. (With several freedoms, one product of the sums: single products cost more.)
template <class J, class T>
[[gnu::always_inline]] inline void add_velocity_product(const Node& n, const Motion<T>& V,
                                                        const T* rates, Motion<T>& a) {
  if constexpr (J::nv == 1)
    J::template add_cross<0>(n, V, rates[n.v], a);
  else
    a += cross(V, joint_twist<J>(n, rates));
}

template <class T>
Motion<T> zero_motion() {
  return {{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
}
/// What the parent of body i holds in `of`, `world` of a root.
template <class T>
Motion<T> parents(const Node& n, const std::vector<Motion<T>>& of, const Motion<T>& world) {
  return n.parent < 0 ? world : of[size_t(n.parent)];
}
template <class T>
Force<T> zero_force() {
  return {{T(0.0), T(0.0), T(0.0)}, {T(0.0), T(0.0), T(0.0)}};
}

/// Root → leaf: body twists V from joint rates v (bodies must be placed).
template <class T>
void twists(const Mechanism& m, Workspace<T>& w, const T* v) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      w.V[i] = joint_twist<decltype(J)>(n, v);
      if (n.parent >= 0) w.V[i] += to_child<decltype(J)>(n, w, i, w.V[size_t(n.parent)]);
    });
  }
}

/// p = lift(q) μ, joint by joint; also p' = G u with joint forces u.
template <class T>
void lift(const Mechanism& m, const T* q, const T* mu, T* p) {
  for (const Node& n : m.nodes())
    visit_joint(n.type, [&](auto J) { decltype(J)::lift(q + n.q, mu + n.v, p + n.q); });
}
/// Its transpose: joint rates from efforts e on p.
template <class T>
void transposed_lift(const Mechanism& m, const T* q, const T* e, T* rates) {
  for (const Node& n : m.nodes())
    visit_joint(n.type,
                [&](auto J) { decltype(J)::transposed_lift(q + n.q, e + n.q, rates + n.v); });
}

/// The rigid inertia of a body in the scalar T.
template <class T>
RigidInertia<T> rigid(const Node& n) {
  return {T(n.inertia.m), Vec3<T>(n.inertia.mc), Sym3<T>(n.inertia.I)};
}

}  // namespace porthos::mechanics::passes
