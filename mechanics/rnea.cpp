#include "mechanics/rnea.h"

#include "mechanics/passes-inl.h"

namespace porthos::mechanics {

template <class T>
void rnea(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> v,
          std::span<const T> vdot, std::span<const Force<T>> wrench, std::span<T> tau) {
  const auto& nodes = m.nodes();
  passes::place_bodies(m, w, q.data());
  const Motion<T> world{{T(0.0), T(0.0), T(0.0)}, -Vec3<T>(m.gravity())};

  // Root → leaf: twists V, accelerations a, net forces b.
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const bool root = n.parent < 0;
      const Motion<T> own =
          v.empty() ? passes::zero_motion<T>() : passes::joint_twist<Joint>(n, v.data());
      w.V[i] = root ? own : w.X[i].to_child(w.V[size_t(n.parent)]) + own;
      w.a[i] = w.X[i].to_child(root ? world : w.a[size_t(n.parent)]) + cross(w.V[i], own);
      if (!vdot.empty()) w.a[i] += passes::joint_twist<Joint>(n, vdot.data());
      const auto I = passes::rigid<T>(n);
      w.b[i] = I * w.a[i] + cross(w.V[i], I * w.V[i]);
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
    });
    if (n.parent >= 0) w.b[size_t(n.parent)] += w.X[i].to_parent(w.b[i]);
  }
}

#define PORTHOS_INSTANTIATE(T)                                                                   \
  template void rnea<T>(const Mechanism&, Workspace<T>&, std::span<const T>, std::span<const T>, \
                        std::span<const T>, std::span<const Force<T>>, std::span<T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
