#pragma once
#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"

namespace porthos::mechanics {
namespace field_detail {

/// Root → leaf: X_i, and w.g_i = weight of body i plus its external wrench. `factor` sums w.g_i
/// over subtrees, leaf → root.
template <class T>
void load_bodies(const Mechanism& m, Workspace<T>& w, const T* q,
                 std::span<const Force<T>> wrench) {
  const auto& nodes = m.nodes();
  const Vec3<T> g_world(m.gravity());
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) { passes::place_body<decltype(J)>(n, w, i, q); });
    const Vec3<T> g = w.X[i].R.tmul(n.parent < 0 ? g_world : w.a[size_t(n.parent)].v);
    w.a[i].v = g;  // gravity in the body's axes
    const auto I = passes::rigid<T>(n);
    w.g[i] = {cross(I.mc, g), I.m * g};
    if (!wrench.empty()) w.g[i] += wrench[i];
  }
}

/// Leaf → root: articulated inertias and momentum bias; with loads, also their subtree sums.
/// Without loads X_i does not exist yet; it is computed here, where it is first used.
template <class T>
void factor(const Mechanism& m, Workspace<T>& w, const T* q, const T* p, bool loaded) {
  const auto& nodes = m.nodes();
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      if (!loaded) passes::place_body<Joint>(n, w, i, q);
      Joint::momentum(q + n.q, p + n.q, w.mu.data() + n.v);
      ArticulatedInertia<T>& A = passes::collected(n, w, i);
      Force<T> b = n.leaf ? passes::zero_force<T>() : w.b[i];
      passes::eliminate<Joint>(n, w, w.mu.data(), n.parent < 0, A, b);
      w.b[i] = b;
      if (n.parent < 0) return;
      passes::pass_to_parent<Joint>(m, n, w.X[i], w, A);
      const Force<T> passed = w.X[i].to_parent(b);
      w.b[size_t(n.parent)] = n.last_child ? passed : w.b[size_t(n.parent)] + passed;
      if (loaded) w.g[size_t(n.parent)] += w.X[i].to_parent(w.g[i]);
    });
  }
}

}  // namespace field_detail

template <class T>
void hamiltonian_field(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                       std::span<const T> p, const Loads<T>& loads, std::span<T> q_dot,
                       std::span<T> p_dot) {
  const auto& nodes = m.nodes();
  const bool loaded = m.has_gravity() || !loads.wrench.empty();
  assert(passes::fits(m, w, q) && passes::sized(p, q.size()));
  assert(passes::sized(q_dot, q.size()) && passes::sized(p_dot, q.size()));
  assert(passes::sized_or_none(loads.tau, size_t(m.nv())));
  assert(passes::sized_or_none(loads.wrench, nodes.size()));
  passes::sines(m, w, q.data());
  if (loaded) field_detail::load_bodies(m, w, q.data(), loads.wrench);

  // The code below needs h_i = A_i V_i + b_i, but the elimination overwrites A_i. After the
  // elimination of S, A_i' V' + b_i' with V' = X_i V_λ is the same h_i, because V = V' + S D⁻¹ (u -
  // Uᵀ V'). So the momentum of the subtree does not need the old A. A rotor's own momentum is in D
  // and u only; h is that of the bodies.
  field_detail::factor(m, w, q.data(), p.data(), loaded);

  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const bool root = n.parent < 0;
      const Motion<T> carried =
          root ? passes::zero_motion<T>() : w.X[i].to_child(w.V[size_t(n.parent)]);
      Motion<T> V = carried;
      passes::back_substitute<Joint>(n, w, V, w.rate.data());
      w.V[i] = V;

      // At a root carried = 0, and at a free joint the remaining A is 0: h = b.
      const Force<T> h =
          root || Joint::nv == 6 ? w.b[i] : passes::left_times<Joint>(n, w.A[i], carried) + w.b[i];
      T load[Joint::nv];
      unroll<Joint::nv>([&](auto k) {
        load[k] = loads.tau.empty() ? T(0.0) : loads.tau[size_t(n.v + k)];
        if (loaded) load[k] = load[k] + Joint::template project<k>(n, w.g[i]);
      });
      const T* rate = w.rate.data() + n.v;
      if constexpr (Joint::lifted) {
        Joint::field(q.data() + n.q, p.data() + n.q, rate, V, h, load, q_dot.data() + n.q,
                     p_dot.data() + n.q);
      } else {
        Joint::rates(q.data() + n.q, rate, q_dot.data() + n.q);
        const Force<T> gyroscopic = cross(V, h);
        unroll<Joint::nv>([&](auto k) {
          p_dot[size_t(n.q + k)] = load[k] - Joint::template project<k>(n, gyroscopic);
        });
      }
    });
  }
}

template <class T>
void rates_from_momenta(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<const T> p) {
  const auto& nodes = m.nodes();
  assert(passes::fits(m, w, q) && passes::sized(p, q.size()));
  passes::sines(m, w, q.data());
  field_detail::factor(m, w, q.data(), p.data(), false);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      w.V[i] = n.parent < 0 ? passes::zero_motion<T>() : w.X[i].to_child(w.V[size_t(n.parent)]);
      passes::back_substitute<decltype(J)>(n, w, w.V[i], w.rate.data());
    });
  }
}

}  // namespace porthos::mechanics
