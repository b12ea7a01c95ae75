#pragma once
#include "mechanics/crba.h"

#include "mechanics/passes-inl.h"

namespace porthos::mechanics {
template <class T>
[[gnu::flatten]] void crba(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                           std::span<T> M) {
  const auto& nodes = m.nodes();
  const size_t nv = size_t(m.nv());
  assert(passes::fits(m, w, q) && passes::sized(M, nv * nv));
  passes::place_joints(m, w, q.data());
  for (auto& e : M) e = T(0.0);

  // A_i holds the composite inertia in its rigid form: only mass, first moment and I are used.
  std::span<ArticulatedInertia<T>> C(w.A);
  const auto load = [&](size_t i) { return RigidInertia<T>{C[i].M.xx, C[i].H.x, C[i].I}; };
  const auto store = [&](size_t i, const RigidInertia<T>& r) {
    C[i].M.xx = r.m;
    C[i].H.x = r.mc;
    C[i].I = r.I;
  };
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    const RigidInertia<T> composite = n.leaf ? passes::rigid<T>(n) : load(i);
    if (n.parent >= 0) {
      const Node& parent = nodes[size_t(n.parent)];
      const RigidInertia<T> above =
          n.last_child ? passes::rigid<T>(parent) : load(size_t(n.parent));
      RigidInertia<T> below = composite;
      if (n.axial)
        passes::climb<void>(n, w.screw[i], below);
      else
        below = mechanics::to_parent(w.X[i], composite);
      store(size_t(n.parent), {above.m + below.m, above.mc + below.mc, above.I + below.I});
    }
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      unroll<Joint::nv>([&](auto k) {
        const size_t column = size_t(n.v + k);
        Force<T> F = Joint::template column<k>(n, composite);
        unroll<Joint::nv>(
            [&](auto l) { M[size_t(n.v + l) + nv * column] = Joint::template project<l>(n, F); });
        if constexpr (Joint::nv == 1)
          if (n.rotor_inertia != 0)
            M[column + nv * column] = M[column + nv * column] + T(n.rotor_inertia);
        for (int j = int(i); nodes[size_t(j)].parent >= 0;) {  // up the supporting path
          F = passes::to_parent<void>(nodes[size_t(j)], w, size_t(j), F);
          j = nodes[size_t(j)].parent;
          const Node& a = nodes[size_t(j)];
          visit_joint(a.type, [&](auto K) {
            unroll<decltype(K)::nv>([&](auto l) {
              const T e = decltype(K)::template project<l>(a, F);
              const size_t row = size_t(a.v + l);
              M[row + nv * column] = e;
              M[column + nv * row] = e;
            });
          });
        }
      });
    });
  }
}

}  // namespace porthos::mechanics
