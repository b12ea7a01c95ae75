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

/// Calls f(index, column) for the freedoms of joint i, which end where those of the next begin.
template <class T, class F>
void each_freedom(const Mechanism& m, size_t i, const DerivativeWorkspace<T>& d, F f) {
  const auto& nodes = m.nodes();
  const size_t end = size_t(i + 1 < nodes.size() ? nodes[i + 1].v : m.nv());
  for (size_t l = size_t(nodes[i].v); l < end; ++l) f(l, d.columns[l]);
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
  each_freedom(m, i, d, [&](size_t l, const auto& own) {
    dq[l + nv * j] = dot(own.S, by_q);
    dv[l + nv * j] = dot(own.S, by_v);
  });
  by_q += cross(c.S, b.f);
  for (int a = nodes[i].parent; a >= 0; a = nodes[size_t(a)].parent)
    each_freedom(m, size_t(a), d, [&](size_t l, const auto& up) {
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

/// The entry in column l of a group.
template <class T>
T entry_of(const typename ColumnsOf<T>::type& x, int l) {
  if constexpr (ColumnsOf<T>::count == 1)
    return x;
  else
    return x[l];
}
/// Sets it.
template <class T>
void set_entry(typename ColumnsOf<T>::type& x, [[maybe_unused]] int l, const T& value) {
  if constexpr (ColumnsOf<T>::count == 1)
    x = value;
  else
    x.set(l, value);
}

/// The factors that aba() left, for a group of columns.
template <class T>
const auto& factor_of_columns(const Mechanism& m, const Workspace<T>& w,
                              DerivativeWorkspace<T>& d) {
  if constexpr (ColumnsOf<T>::count == 1) {
    return w;
  } else {
    using Columns = typename ColumnsOf<T>::type;
    Workspace<Columns>& f = *d.factor;
    for (size_t i = 0; i < m.nodes().size(); ++i) {
      f.screw[i] = Screw<Columns>(w.screw[i]);
      f.X[i] = converted<Columns>(w.X[i]);
    }
    for (size_t j = 0; j < w.K.size(); ++j) {
      for (int k = 0; k < 6; ++k) f.K[j][k] = Columns(w.K[j][k]);
      f.D_inverse[j] = Columns(w.D_inverse[j]);
    }
    return f;
  }
}

/// Columns of M⁻¹ from the `first` on, by the factors in w.
template <class T, class Columns>
void solve_units(const Mechanism& m, const Workspace<Columns>& w, DerivativeWorkspace<T>& d,
                 size_t first, std::span<Columns> rows) {
  const auto& nodes = m.nodes();
  std::fill(d.beta.begin(), d.beta.end(), passes::zero_force<Columns>());
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      Force<Columns>& b = d.beta[i];
      unroll_descending<decltype(J)::nv>([&](auto k) {
        const size_t l = size_t(n.v + k);
        Columns unit(0.0);
        if (l >= first && l < first + ColumnsOf<T>::count)
          set_entry<T>(unit, int(l - first), T(1.0));
        const Columns u = unit - decltype(J)::template project<k>(n, b);
        rows[l] = u;
        b = fma(u, w.K[l], b);
      });
      if (n.parent >= 0) d.beta[size_t(n.parent)] += passes::to_parent<decltype(J)>(n, w, i, b);
    });
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      Motion<Columns>& a = d.alpha[i];
      a = n.parent < 0 ? passes::zero_motion<Columns>()
                       : passes::to_child<decltype(J)>(n, w, i, d.alpha[size_t(n.parent)]);
      unroll<decltype(J)::nv>([&](auto k) {
        const size_t l = size_t(n.v + k);
        rows[l] = fma(w.D_inverse[l], rows[l], -dot(a, w.K[l]));
        decltype(J)::template add<k>(n, rows[l], a);
      });
    });
  }
}

/// M⁻¹, column by column, from the factors that aba() left in w.
template <class T>
void invert(const Mechanism& m, const Workspace<T>& w, DerivativeWorkspace<T>& d,
            std::span<T> dtau) {
  constexpr int count = ColumnsOf<T>::count;
  const size_t nv = size_t(m.nv());
  const auto& factor = factor_of_columns(m, w, d);
  const auto rows = std::span(d.product).first(nv);
  for (size_t first = 0; first < nv; first += count) {
    solve_units(m, factor, d, first, rows);
    for (size_t j = first; j < std::min(nv, first + count); ++j)
      for (size_t i = 0; i < nv; ++i) dtau[i + nv * j] = entry_of<T>(rows[i], int(j - first));
  }
}

/// D ← -M⁻¹ D, both column by column, for each of the matrices.
template <class T>
void divide_by_mass(const Mechanism& m, DerivativeWorkspace<T>& d, std::span<const T> inverse,
                    std::initializer_list<std::span<T>> matrices) {
  using Columns = typename ColumnsOf<T>::type;
  constexpr int count = ColumnsOf<T>::count;
  const size_t nv = size_t(m.nv()), blocks = DerivativeWorkspace<T>::blocks(m);
  for (size_t b = 0; b < blocks; ++b)  // M⁻¹ by groups of rows, filled up with zeros
    for (size_t k = 0; k < nv; ++k) {
      Columns& rows = d.inverse[b * nv + k] = Columns(0.0);
      for (size_t i = b * count; i < std::min(nv, (b + 1) * count); ++i)
        set_entry<T>(rows, int(i - b * count), -inverse[i + nv * k]);
    }
  for (const std::span<T>& D : matrices)
    for (size_t j = 0; j < nv; ++j) {
      for (size_t b = 0; b < blocks; ++b) {
        Columns sum(0.0);
        for (size_t k = 0; k < nv; ++k)
          sum = fma(d.inverse[b * nv + k], Columns(D[k + nv * j]), sum);
        d.product[b] = sum;
      }
      for (size_t i = 0; i < nv; ++i)
        D[i + nv * j] = entry_of<T>(d.product[i / count], int(i % count));
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
    each_freedom(m, i, d, [&](size_t j, const auto& c) {
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
        each_freedom(m, size_t(i), d, [&](size_t l, const auto& c) { column[l] = dot(c.S, f); });
    }
  }
}

template <class T>
void aba_derivatives(const Mechanism& m, Workspace<T>& w, DerivativeWorkspace<T>& d,
                     std::span<const T> q, std::span<const T> v, const Loads<T>& loads,
                     std::span<T> vdot, std::span<T> dq, std::span<T> dv, std::span<T> dtau) {
  assert(passes::sized(dtau, size_t(m.nv()) * size_t(m.nv())));
  aba<T>(m, w, q, v, loads, vdot);
  invert(m, w, d, dtau);
  rnea_derivatives<T>(m, w, d, q, v, vdot, loads.wrench, d.tau, dq, dv);
  divide_by_mass<T>(m, d, dtau, {dq, dv});
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
