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
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const bool root = n.parent < 0;
      passes::place_body<Joint>(n, w, i, q.data());
      Motion<T> V =
          root ? passes::zero_motion<T>() : passes::to_child<Joint>(n, w, i, w.V[size_t(n.parent)]);
      Motion<T> a =
          root ? w.X[i].to_child(world) : passes::to_child<Joint>(n, w, i, w.a[size_t(n.parent)]);
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
    });
  }
  // Leaf → root: joint forces τ = Sᵀ f.
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      unroll<decltype(J)::nv>(
          [&](auto k) { tau[size_t(n.v + k)] = decltype(J)::template project<k>(n, w.b[i]); });
      if constexpr (decltype(J)::nv == 1)
        if (n.rotor_inertia != 0 && !vdot.empty())
          tau[size_t(n.v)] = tau[size_t(n.v)] + T(n.rotor_inertia) * vdot[size_t(n.v)];
      if (n.parent >= 0) w.b[size_t(n.parent)] += passes::to_parent<decltype(J)>(n, w, i, w.b[i]);
    });
  }
}

}  // namespace porthos::mechanics
