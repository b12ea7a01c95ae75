#pragma once
#include "mechanics/rnea.h"

#include "mechanics/passes-inl.h"

namespace porthos::mechanics {

template <class T>
void rnea(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> v,
          std::span<const T> vdot, std::span<const Force<T>> wrench, std::span<T> tau) {
  const auto& nodes = m.nodes();
  [[maybe_unused]] const auto nv = size_t(m.nv());
  assert(passes::fits(m, w, q) && passes::sized_or_none(v, nv) && passes::sized_or_none(vdot, nv));
  assert(passes::sized_or_none(wrench, nodes.size()) && passes::sized(tau, nv));
  passes::sines(m, w, q.data());
  const Motion<T> world{{T(0.0), T(0.0), T(0.0)}, -Vec3<T>(m.gravity())};

  // Root → leaf: twists V, accelerations a, net forces b.
  passes::runs_down(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Motion<T> V = passes::parents(nodes[i], w.V, passes::zero_motion<T>());
    Motion<T> a = passes::parents(nodes[i], w.a, world);
    do {
      const Node& n = nodes[i];
      const bool root = n.parent < 0;
      passes::place_body<Joint>(n, w, i, q.data());
      if (!root) V = passes::to_child<Joint>(n, w, i, V);
      a = root ? w.X[i].to_child(a) : passes::to_child<Joint>(n, w, i, a);
      if (!v.empty()) {
        passes::add_joint_twist<Joint>(n, v.data(), V);
        passes::add_velocity_product<Joint>(n, V, v.data(), a);
      }
      if (!vdot.empty()) passes::add_joint_twist<Joint>(n, vdot.data(), a);
      const auto I = passes::rigid<T>(n);
      w.V[i] = V;
      w.a[i] = a;
      w.b[i] = I * a + cross(V, I * V);
      if (!wrench.empty()) w.b[i] -= wrench[i];
    } while (passes::in_run(nodes, ++i));
    return i;
  });
  // Leaf → root: joint forces τ = Sᵀ f.
  passes::runs_up(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Force<T> b = w.b[i - 1];
    do {
      const Node& n = nodes[--i];
      unroll<Joint::nv>([&](auto k) { tau[size_t(n.v + k)] = Joint::template project<k>(n, b); });
      if constexpr (Joint::nv == 1)
        if (passes::has_rotor<Joint>(n) && !vdot.empty())
          tau[size_t(n.v)] = tau[size_t(n.v)] + T(n.rotor_inertia) * vdot[size_t(n.v)];
      if (n.parent < 0) return i;
      b = w.b[size_t(n.parent)] + passes::to_parent<Joint>(n, w, i, b);
      w.b[size_t(n.parent)] = b;
    } while (passes::in_run(nodes, i));
    return i;
  });
}

}  // namespace porthos::mechanics
