#pragma once
#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"

namespace porthos::mechanics {
namespace field_detail {

/// What acts on the bodies besides joint forces.
enum class Load {
  none,
  weight,  ///< uniform gravity alone: first moments of subtrees, summed beside the inertias
  wrench   ///< external wrenches, with or without gravity
};

/// Root → leaf: w.a_i.v = gravity in the axes of body i.
template <class J, class T>
[[gnu::always_inline]] inline void turn_gravity(const Mechanism& m, const Node& n, Workspace<T>& w,
                                                size_t i) {
  w.a[i].v = n.parent < 0 ? w.X[i].R.tmul(Vec3<T>(m.gravity()))
                          : passes::to_child<J>(n, w, i, w.a[size_t(n.parent)].v);
}

/// Root → leaf: the placements, and w.g_i = weight of body i plus its external wrench. `factor`
/// sums w.g_i over subtrees, leaf → root.
template <class T>
void load_bodies(const Mechanism& m, Workspace<T>& w, const T* q,
                 std::span<const Force<T>> wrench) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      passes::place_body<decltype(J)>(n, w, i, q);
      turn_gravity<decltype(J)>(m, n, w, i);
    });
    const Vec3<T>& g = w.a[i].v;
    const auto I = passes::rigid<T>(n);
    w.g[i] = Force<T>{cross(I.mc, g), I.m * g} + wrench[i];
  }
}

/// Adds the first moment of the subtree of body i to that of its parent's; w.g_i.n holds them.
template <class J, class T>
[[gnu::always_inline]] inline void pass_first_moment(const Mechanism& m, const Node& n,
                                                     Workspace<T>& w, size_t i) {
  screw::Moment<T> a{w.g[i].n, passes::subtree_mass(n, w, i)};
  if (passes::about_z<J> && n.axial)
    passes::climb<J>(n, w.screw[i], a);
  else
    a.mc = fma(w.X[i].R, a.mc, a.m * w.X[i].r);
  const size_t parent = size_t(n.parent);
  w.g[parent].n =
      a.mc + (n.last_child ? Vec3<T>(passes::own_inertia(m.nodes()[parent], w, parent).mc)
                           : w.g[parent].n);
}

/// Leaf → root: articulated inertias and momentum bias, and what `load` needs of subtrees. Without
/// wrenches bodies have no placement yet; it is computed here, where it is first used.
template <class T>
void factor(const Mechanism& m, Workspace<T>& w, const T* q, const T* p, Load load) {
  const auto& nodes = m.nodes();
  passes::runs_up(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    ArticulatedInertia<T> A = passes::collected(nodes[i - 1], w, i - 1);
    Force<T> b = nodes[i - 1].leaf ? passes::zero_force<T>() : w.b[i - 1];
    do {
      const Node& n = nodes[--i];
      if (load != Load::wrench) passes::place_body<Joint>(n, w, i, q);
      if (load == Load::weight && n.leaf) w.g[i].n = Vec3<T>(passes::own_inertia(n, w, i).mc);
      Joint::momentum(q + n.q, p + n.q, w.mu.data() + n.v);
      passes::eliminate<Joint>(n, w, w.mu.data(), n.parent < 0, A, b);
      passes::keep_left<Joint>(n, A, w.A[i]);
      w.b[i] = b;
      if (n.parent < 0) return i;
      const size_t parent = size_t(n.parent);
      passes::pass_to_parent<Joint>(m, n, w, i, A);
      b = passes::to_parent<Joint>(n, w, i, b);
      if (!n.last_child) b += w.b[parent];
      if (load == Load::weight) pass_first_moment<Joint>(m, n, w, i);
      if (load == Load::wrench) w.g[parent] += passes::to_parent<Joint>(n, w, i, w.g[i]);
    } while (passes::in_run(nodes, i));
    const size_t parent = size_t(nodes[i].parent);
    w.A[parent] = A;
    w.b[parent] = b;
    return i;
  });
}

}  // namespace field_detail

template <class T>
void hamiltonian_field(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                       std::span<const T> p, const Loads<T>& loads, std::span<T> q_dot,
                       std::span<T> p_dot) {
  const auto& nodes = m.nodes();
  using field_detail::Load;
  const Load load = !loads.wrench.empty() ? Load::wrench
                    : m.has_gravity()     ? Load::weight
                                          : Load::none;
  assert(passes::fits(m, w, q) && passes::sized(p, q.size()));
  assert(passes::sized(q_dot, q.size()) && passes::sized(p_dot, q.size()));
  assert(passes::sized_or_none(loads.tau, size_t(m.nv())));
  assert(passes::sized_or_none(loads.wrench, nodes.size()));
  passes::sines(m, w, q.data());
  if (load == Load::wrench) field_detail::load_bodies(m, w, q.data(), loads.wrench);

  // The code below needs h_i = A_i V_i + b_i, but the elimination overwrites A_i. After the
  // elimination of S, A_i' V' + b_i' with V' = X_i V_λ is the same h_i, because V = V' + S D⁻¹ (u -
  // Uᵀ V'). So the momentum of the subtree does not need the old A. A rotor's own momentum is in D
  // and u only; h is that of the bodies.
  field_detail::factor(m, w, q.data(), p.data(), load);

  passes::runs_down(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Motion<T> V = passes::parents(nodes[i], w.V, passes::zero_motion<T>());
    do {
      const Node& n = nodes[i];
      const bool root = n.parent < 0;
      const Motion<T> carried = root ? V : passes::to_child<Joint>(n, w, i, V);
      V = carried;
      passes::back_substitute<Joint>(n, w, V, w.rate.data());
      w.V[i] = V;

      // At a root carried = 0, and at a free joint the remaining A is 0: h = b.
      const Force<T> h =
          root || Joint::nv == 6 ? w.b[i] : passes::left_times<Joint>(n, w.A[i], carried) + w.b[i];
      if (load == Load::weight) {
        field_detail::turn_gravity<Joint>(m, n, w, i);
        const Vec3<T>& g = w.a[i].v;
        w.g[i] = {cross(w.g[i].n, g), passes::subtree_mass(n, w, i) * g};
      }
      T force[Joint::nv];
      unroll<Joint::nv>([&](auto k) {
        force[k] = loads.tau.empty() ? T(0.0) : loads.tau[size_t(n.v + k)];
        if (load != Load::none) force[k] = force[k] + Joint::template project<k>(n, w.g[i]);
      });
      const T* rate = w.rate.data() + n.v;
      if constexpr (Joint::lifted) {
        Joint::field(q.data() + n.q, p.data() + n.q, rate, V, h, force, q_dot.data() + n.q,
                     p_dot.data() + n.q);
      } else {
        Joint::rates(q.data() + n.q, rate, q_dot.data() + n.q);
        const Force<T> gyroscopic = cross(V, h);
        unroll<Joint::nv>([&](auto k) {
          p_dot[size_t(n.q + k)] = force[k] - Joint::template project<k>(n, gyroscopic);
        });
      }
    } while (passes::in_run(nodes, ++i));
    return i;
  });
}

template <class T>
void rates_from_momenta(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<const T> p) {
  const auto& nodes = m.nodes();
  assert(passes::fits(m, w, q) && passes::sized(p, q.size()));
  passes::sines(m, w, q.data());
  field_detail::factor(m, w, q.data(), p.data(), field_detail::Load::none);
  passes::runs_down(m, [&](auto J, size_t i) {
    using Joint = decltype(J);
    Motion<T> V = passes::parents(nodes[i], w.V, passes::zero_motion<T>());
    do {
      const Node& n = nodes[i];
      if (n.parent >= 0) V = passes::to_child<Joint>(n, w, i, V);
      passes::back_substitute<Joint>(n, w, V, w.rate.data());
      w.V[i] = V;
    } while (passes::in_run(nodes, ++i));
    return i;
  });
}

}  // namespace porthos::mechanics
