#pragma once
#include "mechanics/aba.h"

#include "mechanics/passes-inl.h"

namespace porthos::mechanics {

template <class T>
void aba(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> v,
         const Loads<T>& loads, std::span<T> vdot) {
  const auto& nodes = m.nodes();
  [[maybe_unused]] const auto nv = size_t(m.nv());
  assert(passes::fits(m, w, q) && passes::sized_or_none(v, nv) && passes::sized(vdot, nv));
  assert(passes::sized_or_none(loads.tau, nv));
  assert(passes::sized_or_none(loads.wrench, nodes.size()));
  passes::sines(m, w, q.data());

  // Root → leaf: twists V, velocity-product accelerations a = V × S v, bias forces b = V ×* I V -
  // wrench.
  passes::runs_down(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Motion<T> V = passes::parents(nodes[i], w.V, passes::zero_motion<T>());
    do {
      const Node& n = nodes[i];
      passes::place_body<Joint>(n, w, i, q.data());
      Motion<T> a = passes::zero_motion<T>();
      if (n.parent >= 0) V = passes::to_child<Joint>(n, w, i, V);
      passes::add_joint_twist<Joint>(n, v.data(), V);
      passes::add_velocity_product<Joint>(n, V, v.data(), a);
      w.V[i] = V;
      w.a[i] = a;
      w.b[i] = cross(V, passes::rigid<T>(n) * V);
      if (!loads.wrench.empty()) w.b[i] -= loads.wrench[i];
    } while (passes::in_run(nodes, ++i));
    return i;
  });

  // Leaf → root: articulated inertia and bias, b ← b + A a + U D⁻¹ u with u = τ - Sᵀ(b + A_before
  // a).
  for (size_t j = 0; j < w.mu.size(); ++j) w.mu[j] = loads.tau.empty() ? T(0.0) : loads.tau[j];
  passes::runs_up(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    ArticulatedInertia<T> A = passes::collected(nodes[i - 1], w, i - 1);
    Force<T> b = w.b[i - 1];
    do {
      const Node& n = nodes[--i];
      passes::eliminate<Joint>(n, w, w.mu.data(), n.parent < 0, A, b);
      if (n.parent < 0) return i;
      if constexpr (Joint::nv < 6) b += passes::left_times<Joint>(n, A, w.a[i]);
      passes::pass_to_parent<Joint>(m, n, w, i, A);
      b = w.b[size_t(n.parent)] + passes::to_parent<Joint>(n, w, i, b);
    } while (passes::in_run(nodes, i));
    const size_t parent = size_t(nodes[i].parent);
    w.A[parent] = A;
    w.b[parent] = b;
    return i;
  });

  // Root → leaf: accelerations. Gravity enters as an upward acceleration of the world.
  const Vec3<T> g(m.gravity());
  const Motion<T> world{{T(0.0), T(0.0), T(0.0)}, -g};
  passes::runs_down(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Motion<T> a = passes::parents(nodes[i], w.a, world);
    do {
      const Node& n = nodes[i];
      a = w.a[i] + (n.parent < 0 ? w.X[i].to_child(a) : passes::to_child<Joint>(n, w, i, a));
      passes::back_substitute<Joint>(n, w, a, vdot.data());
      w.a[i] = a;
    } while (passes::in_run(nodes, ++i));
    return i;
  });
}

}  // namespace porthos::mechanics
