#include "mechanics/derivatives/dynamics_derivatives.h"

#include <algorithm>

#include "mechanics/aba.h"
#include "mechanics/kinematics.h"
#include "mechanics/passes-inl.h"

namespace porthos::mechanics {
namespace {

/// N of a body: 2B turns ω into the moment N ω = -2 V_ω × (E ω) - 2 mc × (V_v × ω), with
/// E = ½ tr(I) 1 - I.
template <class T>
Mat3<T> gyration(const RigidInertia<T>& I, const Motion<T>& V) {
  const T half = T(0.5) * (I.I.xx + I.I.yy + I.I.zz), o(0.0), two(2.0);
  const Mat3<T> E =
      Sym3<T>{half - I.I.xx, -I.I.xy, -I.I.xz, half - I.I.yy, -I.I.yz, half - I.I.zz}.full();
  const auto column = [&](const Vec3<T>& e, const Vec3<T>& axis) {
    return -two * (cross(V.w, e) + cross(I.mc, cross(V.v, axis)));
  };
  return {column(E.x, {T(1.0), o, o}), column(E.y, {o, T(1.0), o}), column(E.z, {o, o, T(1.0)})};
}

/// 2B m + I a, of a subtree.
template <class T>
Force<T> change(const typename DerivativeWorkspace<T>::Body& b, const Motion<T>& m,
                const Motion<T>& a) {
  return Force<T>{b.N * m.w, T(2.0) * cross(m.w, b.p)} + b.I * a;
}

/// Root → leaf: twists, accelerations and forces of the bodies, columns of the freedoms.
template <class T>
void spread(const Mechanism& m, DerivativeWorkspace<T>& d, std::span<const T> v,
            std::span<const T> vdot, std::span<const Force<T>> wrench) {
  using Body = typename DerivativeWorkspace<T>::Body;
  const Motion<T> still = passes::zero_motion<T>(), world{still.w, -Vec3<T>(m.gravity())};
  const Vec3<T> origin = d.pose[0].r;
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const Node& n = m.nodes()[i];
    Transform<T>& X = d.pose[i];
    X.r = X.r - origin;
    const Motion<T>& V_parent = n.parent < 0 ? still : d.bodies[size_t(n.parent)].V;
    const Motion<T>& a_parent = n.parent < 0 ? world : d.bodies[size_t(n.parent)].a;
    Body& b = d.bodies[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const Motion<T> own = X.to_parent(passes::joint_twist<Joint>(n, v.data()));
      b.V = V_parent + own;
      b.a = a_parent + X.to_parent(passes::joint_twist<Joint>(n, vdot.data())) + cross(b.V, own);
      unroll<Joint::nv>([&](auto k) {
        auto& c = d.columns[size_t(n.v + k)];
        Motion<T> S = still;
        Joint::template add<k>(n, T(1.0), S);
        c.S = X.to_parent(S);
        c.P = cross(V_parent, c.S);
        c.Q = cross(a_parent, c.S) + cross(V_parent, c.P);
        c.U = c.P + cross(b.V, c.S);
      });
    });
    b.I = to_parent(X, passes::rigid<T>(n));
    const Force<T> h = b.I * b.V;
    b.p = h.f;
    b.f = b.I * b.a + cross(b.V, h);
    if (!wrench.empty()) b.f -= X.to_parent(wrench[i]);
    b.N = gyration(b.I, b.V);
  }
}

/// Calls f(index, column) for the freedoms of a joint.
template <class T, class F>
void each_freedom(const Node& n, const DerivativeWorkspace<T>& d, F f) {
  visit_joint(n.type, [&](auto J) {
    for (size_t l = size_t(n.v); l < size_t(n.v) + decltype(J)::nv; ++l) f(l, d.columns[l]);
  });
}

/// The entries of one freedom with all that carry it.
template <class T>
void fill_column(const Mechanism& m, const DerivativeWorkspace<T>& d, size_t i, size_t j,
                 std::span<T> dq, std::span<T> dv) {
  const auto& nodes = m.nodes();
  const size_t nv = size_t(m.nv());
  const auto& b = d.bodies[i];
  const auto& c = d.columns[j];
  Force<T> by_q = change(b, c.P, c.Q);
  const Force<T> by_v = change(b, c.S, c.U), G = b.I * c.S;
  const Vec3<T> H = fma(T(2.0), cross(b.p, c.S.v), b.N.tmul(c.S.w));
  each_freedom(nodes[i], d, [&](size_t l, const auto& own) {
    dq[l + nv * j] = dot(own.S, by_q);
    dv[l + nv * j] = dot(own.S, by_v);
  });
  by_q += cross(c.S, b.f);
  for (int a = nodes[i].parent; a >= 0; a = nodes[size_t(a)].parent)
    each_freedom(nodes[size_t(a)], d, [&](size_t l, const auto& up) {
      dq[l + nv * j] = dot(up.S, by_q);
      dv[l + nv * j] = dot(up.S, by_v);
      dq[j + nv * l] = dot(H, up.P.w) + dot(up.Q, G);
      dv[j + nv * l] = dot(H, up.S.w) + dot(up.U, G);
    });
}

/// I a + V ×* I V for a body's I with a one in its k-th number and zeros elsewhere.
template <class T>
Force<T> force_of_number(int k, const Motion<T>& V, const Motion<T>& a) {
  T one[10];
  for (int l = 0; l < 10; ++l) one[l] = T(l == k ? 1.0 : 0.0);
  const RigidInertia<T> I{
      one[0], {one[1], one[2], one[3]}, {one[4], one[5], one[6], one[7], one[8], one[9]}};
  return I * a + cross(V, I * V);
}

/// Column j of M⁻¹ by the factors that aba() left in w.
template <class T>
void solve_unit(const Mechanism& m, const Workspace<T>& w, DerivativeWorkspace<T>& d, size_t j,
                std::span<T> column) {
  const auto& nodes = m.nodes();
  std::fill(d.beta.begin(), d.beta.end(), passes::zero_force<T>());
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      Force<T>& b = d.beta[i];
      unroll_descending<decltype(J)::nv>([&](auto k) {
        const size_t l = size_t(n.v + k);
        const T u = T(l == j ? 1.0 : 0.0) - decltype(J)::template project<k>(n, b);
        column[l] = u;
        b = fma(u, w.K[l], b);
      });
      if (n.parent >= 0) d.beta[size_t(n.parent)] += passes::to_parent<decltype(J)>(n, w, i, b);
    });
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      Motion<T>& a = d.alpha[i];
      a = n.parent < 0 ? passes::zero_motion<T>()
                       : passes::to_child<decltype(J)>(n, w, i, d.alpha[size_t(n.parent)]);
      unroll<decltype(J)::nv>([&](auto k) {
        const size_t l = size_t(n.v + k);
        column[l] = fma(w.D_inverse[l], column[l], -dot(a, w.K[l]));
        decltype(J)::template add<k>(n, column[l], a);
      });
    });
  }
}

}  // namespace

template <class T>
void rnea_derivatives(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                      std::span<const T> q, std::span<const T> v, std::span<const T> vdot,
                      std::span<const Force<T>> wrench, std::span<T> tau, std::span<T> dq,
                      std::span<T> dv) {
  const auto& nodes = m.nodes();
  [[maybe_unused]] const size_t nv = size_t(m.nv());
  assert(passes::sized(v, nv) && passes::sized(vdot, nv) && passes::sized(tau, nv));
  assert(passes::sized(dq, nv * nv) && passes::sized(dv, nv * nv));
  forward_kinematics<T>(m, w, q, d.pose);
  spread(m, d, v, vdot, wrench);
  std::fill(dq.begin(), dq.end(), T(0.0));
  std::fill(dv.begin(), dv.end(), T(0.0));
  for (size_t i = nodes.size(); i-- > 0;) {  // leaf → root: the bodies become their subtrees
    const Node& n = nodes[i];
    const auto& b = d.bodies[i];
    each_freedom(n, d, [&](size_t j, const auto& c) {
      tau[j] = dot(c.S, b.f);
      if (n.rotor_inertia != 0) tau[j] = tau[j] + T(n.rotor_inertia) * vdot[j];
      fill_column(m, d, i, j, dq, dv);
    });
    if (n.parent < 0) continue;
    auto& up = d.bodies[size_t(n.parent)];
    up.I = {up.I.m + b.I.m, up.I.mc + b.I.mc, up.I.I + b.I.I};
    up.f += b.f;
    up.N = up.N + b.N;
    up.p += b.p;
  }
}

template <class T>
void inertial_regressor(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                        std::span<const T> q, std::span<const T> v, std::span<const T> vdot,
                        std::span<T> Y) {
  const auto& nodes = m.nodes();
  const size_t nv = size_t(m.nv());
  assert(passes::sized(Y, nv * 10 * m.bodies().size()));
  forward_kinematics<T>(m, w, q, d.pose);
  spread<T>(m, d, v, vdot, {});
  std::fill(Y.begin(), Y.end(), T(0.0));
  for (size_t b = 0; b < m.bodies().size(); ++b) {
    const BodyFrame& body = m.bodies()[b];
    if (body.node < 0) continue;
    const auto X = d.pose[size_t(body.node)] * converted<T>(body.pose);
    const auto& own = d.bodies[size_t(body.node)];
    const Motion<T> V = X.to_child(own.V), a = X.to_child(own.a);
    for (int k = 0; k < 10; ++k) {
      const Force<T> f = X.to_parent(force_of_number(k, V, a));
      const std::span<T> column = Y.subspan(nv * (10 * b + size_t(k)), nv);
      for (int i = body.node; i >= 0; i = nodes[size_t(i)].parent)
        each_freedom(nodes[size_t(i)], d,
                     [&](size_t l, const auto& c) { column[l] = dot(c.S, f); });
    }
  }
}

template <class T>
void aba_derivatives(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                     std::span<const T> q, std::span<const T> v, const Loads<T>& loads,
                     std::span<T> vdot, std::span<T> dq, std::span<T> dv, std::span<T> dtau) {
  const size_t nv = size_t(m.nv());
  assert(passes::sized(dtau, nv * nv));
  aba<T>(m, w, q, v, loads, vdot);
  for (size_t j = 0; j < nv; ++j) solve_unit(m, w, d, j, dtau.subspan(nv * j, nv));
  const std::span<T> tau = std::span(d.product).first(nv);
  rnea_derivatives<T>(m, w, d, q, v, vdot, loads.wrench, tau, dq, dv);
  for (const std::span<T> D : {dq, dv}) {  // D ← -M⁻¹ D
    std::fill(d.product.begin(), d.product.end(), T(0.0));
    for (size_t j = 0; j < nv; ++j)
      for (size_t k = 0; k < nv; ++k)
        for (size_t i = 0; i < nv; ++i)
          d.product[i + nv * j] = fma(-dtau[i + nv * k], D[k + nv * j], d.product[i + nv * j]);
    std::copy(d.product.begin(), d.product.end(), D.begin());
  }
}

#define PORTHOS_INSTANTIATE(T)                                                                    \
  template void rnea_derivatives<T>(const Mechanism&, Workspace<T>&, DerivativeWorkspace<T>&,     \
                                    std::span<const T>, std::span<const T>, std::span<const T>,   \
                                    std::span<const Force<T>>, std::span<T>, std::span<T>,        \
                                    std::span<T>);                                                \
  template void aba_derivatives<T>(const Mechanism&, Workspace<T>&, DerivativeWorkspace<T>&,      \
                                   std::span<const T>, std::span<const T>, const Loads<T>&,       \
                                   std::span<T>, std::span<T>, std::span<T>, std::span<T>);       \
  template void inertial_regressor<T>(const Mechanism&, Workspace<T>&, DerivativeWorkspace<T>&,   \
                                      std::span<const T>, std::span<const T>, std::span<const T>, \
                                      std::span<T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
