#pragma once
#include <span>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"

namespace porthos::contact {

/// w.rate = M⁻¹ f of some nodes, a whole tree or several, root to leaf, with the K and D that the
/// factor of the field left in the workspace.
template <class T>
void solve_tree(const mechanics::Mechanism& m, mechanics::Workspace<T>& w,
                std::span<const size_t> tree, const T* f) {
  namespace passes = mechanics::passes;
  for (const size_t i : tree) w.b[i] = passes::zero_force<T>();
  for (size_t at = tree.size(); at-- > 0;) {
    const size_t i = tree[at];
    const mechanics::Node& n = m.nodes()[i];
    mechanics::visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      mechanics::Force<T>& b = w.b[i];
      mechanics::unroll_descending<Joint::nv>([&](auto k) {
        const size_t j = size_t(n.v) + k;
        w.u[j] = f[j] - Joint::template project<k>(n, b);
        b = fma(w.u[j], w.K[j], b);
      });
      if (n.parent >= 0) w.b[size_t(n.parent)] += passes::to_parent<Joint>(n, w, i, b);
    });
  }
  for (const size_t i : tree) {
    const mechanics::Node& n = m.nodes()[i];
    mechanics::visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      w.V[i] = n.parent < 0 ? passes::zero_motion<T>()
                            : passes::to_child<Joint>(n, w, i, w.V[size_t(n.parent)]);
      passes::back_substitute<Joint>(n, w, w.V[i], w.rate.data());
    });
  }
}

}  // namespace porthos::contact
