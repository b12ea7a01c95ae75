#include "mechanics/derivatives/field_tangent.h"

#include <algorithm>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/passes-inl.h"
#include "phs/system/linearised.h"

namespace porthos::mechanics {
namespace tangent_detail {

/// The displacement of the child against its parent in the child's axes, of a change of
/// coordinates.
template <class J, class T>
Motion<T> displacement(const Node& n, const T* q, const T* dq) {
  Motion<T> zeta = passes::zero_motion<T>();
  if constexpr (!J::lifted) {
    unroll<J::nv>([&](auto k) { J::template add<k>(n, dq[k], zeta); });
  } else {
    constexpr int at = J::nv == 6 ? 3 : 0;  // of the quaternion
    const auto xi = Quaternion<T>::load(q + at);
    zeta.w = transposed_lift(xi, Quaternion<T>::load(dq + at));
    if constexpr (J::nv == 6) zeta.v = rotation_matrix(xi).tmul({dq[0], dq[1], dq[2]});
  }
  return zeta;
}

/// ζ ×* h and V × ζ of a displacement ζ = (0, 0, a; 0, 0, b) where the joint is about z.
template <class J, class T>
Force<T> displaced(const Motion<T>& zeta, const Force<T>& h) {
  if constexpr (J::about_z) {
    const T &a = zeta.w.z, &b = zeta.v.z, o(0.0);
    return {{-fma(a, h.n.y, b * h.f.y), fma(a, h.n.x, b * h.f.x), o}, {-(a * h.f.y), a * h.f.x, o}};
  } else {
    return cross(zeta, h);
  }
}
template <class J, class T>
Motion<T> displaced(const Motion<T>& V, const Motion<T>& zeta) {
  if constexpr (J::about_z) {
    const T &a = zeta.w.z, &b = zeta.v.z, o(0.0);
    return {{V.w.y * a, -(V.w.x * a), o}, {fma(V.v.y, a, V.w.y * b), -fma(V.v.x, a, V.w.x * b), o}};
  } else {
    return cross(V, zeta);
  }
}

/// The change of the joint momenta μ(q, p).
template <class J, class T>
void change_of_momentum(const T* q, const T* p, const T* dq, const T* dp, const Motion<T>& zeta,
                        T* dmu) {
  if constexpr (!J::lifted) {
    for (int k = 0; k < J::nv; ++k) dmu[k] = dp[k];
  } else {
    constexpr int at = J::nv == 6 ? 3 : 0;
    const auto load = [](const T* a) { return Quaternion<T>::load(a + at); };
    const Vec3<T> dm = body_momentum(load(dq), load(p)) + body_momentum(load(q), load(dp));
    for (int k = 0; k < 3; ++k) dmu[k] = dm[k];
    if constexpr (J::nv == 6) {
      const Mat3<T> R = rotation_matrix(load(q));
      const Vec3<T> l = R.tmul({p[0], p[1], p[2]});
      const Vec3<T> dl = R.tmul({dp[0], dp[1], dp[2]}) - cross(zeta.w, l);
      for (int k = 0; k < 3; ++k) dmu[3 + k] = dl[k];
    }
  }
}

/// What the derivative of a lifted joint's field needs of its body, with changes (d…).
template <class T>
struct AtBody {
  Motion<T> V, dV;
  Force<T> h, dh;
  Force<T> g, dg;  ///< weight of the subtree
  Vec3<T> phi;     ///< rotation of the displacement
};

/// The derivative of Spherical::field and Free::field.
template <class J, class T>
void lifted_change(const T* q, const T* p, const T* dq, const T* dp, const T* rate, const T* drate,
                   const AtBody<T>& b, T* dq_dot, T* dp_dot) {
  constexpr int at = J::nv == 6 ? 3 : 0;
  const auto load = [](const T* a) { return Quaternion<T>::load(a + at); };
  const auto xi = load(q), pi = load(p), dxi = load(dq), dpi = load(dp);
  const Vec3<T> w{rate[0], rate[1], rate[2]}, dw{drate[0], drate[1], drate[2]};
  const Vec3<T> m = body_momentum(xi, pi), dm = body_momentum(dxi, pi) + body_momentum(xi, dpi);
  const Vec3<T> rest = b.V.w - w, drest = b.dV.w - dw;  // of the parent
  const Vec3<T> t = b.g.n - cross(b.V.v, b.h.f) - cross(rest, m);
  const Vec3<T> dt =
      b.dg.n - cross(b.dV.v, b.h.f) - cross(b.V.v, b.dh.f) - cross(drest, m) - cross(rest, dm);
  const auto sum = [](const Quaternion<T>& x, const Quaternion<T>& y) {
    return Quaternion<T>{x.w + y.w, x.v + y.v};
  };
  const T half(0.5), two(2.0);
  sum(dxi * (half * w), xi * (half * dw)).store(dq_dot + at);
  const T norm2 = xi.norm2(), along = xi.w * dxi.w + dot(xi.v, dxi.v), f = two / norm2;
  const Vec3<T> scaled = f * (dt - (f * along) * t);
  const auto turned = sum(dpi * (half * w), pi * (half * dw));
  sum(turned, sum(dxi * (f * t), xi * scaled)).store(dp_dot + at);
  if constexpr (J::nv == 6) {
    const Mat3<T> R = rotation_matrix(xi);
    const Vec3<T> u{rate[3], rate[4], rate[5]}, du{drate[3], drate[4], drate[5]};
    const Vec3<T> l = R.tmul({p[0], p[1], p[2]});
    const Vec3<T> dl = R.tmul({dp[0], dp[1], dp[2]}) - cross(b.phi, l);
    const Vec3<T> F = b.g.f - cross(rest, l), dF = b.dg.f - cross(drest, l) - cross(rest, dl);
    const Vec3<T> dr = R * (cross(b.phi, u) + du), dP = R * (cross(b.phi, F) + dF);
    for (int k = 0; k < 3; ++k) {
      dq_dot[k] = dr[k];
      dp_dot[k] = dP[k];
    }
  }
}

}  // namespace tangent_detail

template <class T>
FieldTangent<T>::FieldTangent(const Mechanism& m)
    : m_(m),
      w_(m),
      q_(size_t(m.nq())),
      p_(q_.size()),
      minus_(q_.size()),
      e_(size_t(m.nv())),
      carried_(m.nodes().size()),
      h_(carried_.size()),
      moment_(m.has_gravity() ? carried_.size() : 0),
      zeta_(carried_.size()),
      beta_(carried_.size()),
      rho_(moment_.size()),
      dV_(carried_.size()),
      turn_(moment_.size()),
      dgamma_(moment_.size()),
      sinking_(moment_.size()) {}

template <class T>
void FieldTangent<T>::set_turn_angles(In angles) {
  std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
}

template <class T>
void FieldTangent<T>::at(In q, In p, Out q_dot, Out p_dot) {
  std::copy(q.begin(), q.end(), q_.begin());
  std::copy(p.begin(), p.end(), p_.begin());
  hamiltonian_field<T>(m_, w_, q_, p_, {}, q_dot, p_dot);
  const auto& nodes = m_.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      carried_[i] = n.parent < 0 ? passes::zero_motion<T>()
                                 : w_.V[i] - passes::joint_twist<Joint>(n, w_.rate.data());
      h_[i] = w_.b[i];
      if (n.parent >= 0 && Joint::nv != 6)
        h_[i] += passes::left_times<Joint>(n, w_.A[i], carried_[i]);
    });
  }
  if (moment_.empty()) return;
  passes::place_axial_bodies(m_, w_);
  for (size_t i = 0; i < nodes.size(); ++i)
    moment_[i] = Vec3<T>(passes::own_inertia(nodes[i], w_, i).mc);
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    if (n.parent < 0) continue;
    const T mass = passes::subtree_mass(n, w_, i);
    moment_[size_t(n.parent)] += fma(w_.X[i].R, moment_[i], mass * w_.X[i].r);
  }
}

/// Leaf → root: the momenta that the displacement and dp leave to the joints above. Source of both
/// passes: derivation in docs/derivatives.md.
template <class T>
void FieldTangent<T>::up(In dq, In dp) {
  const auto& nodes = m_.nodes();
  const bool weighs = !moment_.empty();
  std::fill(rho_.begin(), rho_.end(), passes::zero_force<T>());
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const size_t a = size_t(n.q);
      const Motion<T> zeta = tangent_detail::displacement<Joint>(n, &q_[a], &dq[a]);
      zeta_[i] = zeta;
      T dmu[Joint::nv];
      tangent_detail::change_of_momentum<Joint>(&q_[a], &p_[a], &dq[a], &dp[a], zeta, dmu);
      Force<T> beta = n.leaf ? passes::zero_force<T>() : beta_[i];
      unroll_descending<Joint::nv>([&](auto k) {
        const size_t j = size_t(n.v + k);
        e_[j] = dmu[k] - Joint::template project<k>(n, beta);
        beta = fma(e_[j], w_.K[j], beta);
      });
      if constexpr (Joint::nv == 6)
        for (int k = 0; k < 6; ++k) beta[k] = dmu[k];
      beta_[i] = beta;
      if (n.parent < 0) return;
      Force<T> passed = beta + tangent_detail::displaced<Joint>(zeta, h_[i]);
      if constexpr (Joint::nv != 6)
        passed += passes::left_times<Joint>(n, w_.A[i],
                                            tangent_detail::displaced<Joint>(carried_[i], zeta));
      const Force<T> own = passes::to_parent<Joint>(n, w_, i, passed);
      Force<T>& to = beta_[size_t(n.parent)];
      to = n.last_child ? own : to + own;
    });
    if (!weighs) continue;
    const Vec3<T> turned = cross(w_.a[i].v, zeta_[i].w);  // change of gravity by the own turn
    turn_[i] = turned;
    if (n.parent < 0) continue;
    const T mass = passes::subtree_mass(n, w_, i);
    const Force<T> own{cross(moment_[i], turned), mass * turned};
    rho_[size_t(n.parent)] += w_.X[i].to_parent(rho_[i] + own + cross(zeta_[i], w_.g[i]));
  }
}

/// Root → leaf: the change of rates, momenta and weights, and of the field.
template <class T>
void FieldTangent<T>::down(In dq, In dp, Out dq_dot, Out dp_dot) {
  const auto& nodes = m_.nodes();
  const bool weighs = !moment_.empty();
  T* const drate = w_.mu.data();  // the field's own momenta are no longer needed
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    const bool root = n.parent < 0;
    tangent_detail::AtBody<T> b;
    b.V = w_.V[i];
    b.h = h_[i];
    b.dh = beta_[i];
    b.phi = zeta_[i].w;
    b.g = b.dg = passes::zero_force<T>();
    if (weighs) {
      dgamma_[i] = root ? turn_[i] : turn_[i] + w_.X[i].R.tmul(dgamma_[size_t(n.parent)]);
      b.g = w_.g[i];
      b.dg = Force<T>{cross(moment_[i], dgamma_[i]), passes::subtree_mass(n, w_, i) * dgamma_[i]} +
             rho_[i];
    }
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      const Motion<T> W = root ? passes::zero_motion<T>()
                               : passes::to_child<Joint>(n, w_, i, dV_[size_t(n.parent)]) +
                                     tangent_detail::displaced<Joint>(carried_[i], zeta_[i]);
      b.dV = W;
      unroll<Joint::nv>([&](auto k) {
        const size_t j = size_t(n.v + k);
        drate[j] = fma(w_.D_inverse[j], e_[j], -dot(b.dV, w_.K[j]));
        Joint::template add<k>(n, drate[j], b.dV);
      });
      if (!root && Joint::nv != 6) b.dh += passes::left_times<Joint>(n, w_.A[i], W);
      const size_t a = size_t(n.q);
      if constexpr (Joint::lifted) {
        tangent_detail::lifted_change<Joint>(&q_[a], &p_[a], &dq[a], &dp[a], w_.rate.data() + n.v,
                                             drate + n.v, b, &dq_dot[a], &dp_dot[a]);
      } else {
        const Force<T> gyroscopic = cross(b.dV, b.h) + cross(b.V, b.dh);
        unroll<Joint::nv>([&](auto k) {
          dq_dot[a + k] = drate[n.v + k];
          dp_dot[a + k] = Joint::template project<k>(n, b.dg - gyroscopic);
        });
      }
    });
    dV_[i] = b.dV;
  }
}

template <class T>
void FieldTangent<T>::times(In dq, In dp, Out dq_dot, Out dp_dot) {
  up(dq, dp);
  down(dq, dp, dq_dot, dp_dot);
}

template <class T>
void FieldTangent<T>::transpose_times(In lq, In lp, Out out_q, Out out_p) {
  for (size_t i = 0; i < minus_.size(); ++i) minus_[i] = -lp[i];
  times(minus_, lq, out_p, out_q);
  for (T& x : out_q) x = -x;
}

template <class T>
size_t FieldTangent<T>::inertial_count(const Mechanism& m) {
  size_t count = m.joint_properties().size();
  for (const BodyFrame& body : m.bodies()) count += body.node < 0 ? 0 : 10;
  return count;
}

/// At fixed momenta ∂H/∂θ = -∂T/∂θ at fixed rates + ∂V/∂θ, so nothing of M⁻¹ is differentiated. T
/// is bilinear in the twist of each body, and V = -(m g·r + g·mc).
template <class T>
void FieldTangent<T>::add_inertial_gradient(const T& weight, Out gradient) {
  const auto& nodes = m_.nodes();
  for (size_t i = 0; i < sinking_.size(); ++i) {
    sinking_[i] = dot(w_.a[i].v, zeta_[i].v);
    if (nodes[i].parent < 0) continue;
    const size_t parent = size_t(nodes[i].parent);
    sinking_[i] = sinking_[i] + sinking_[parent] + dot(dgamma_[parent], w_.X[i].r);
  }
  T* g = gradient.data();
  const auto add = [&](const T& x) {
    *g = *g - weight * x;
    ++g;
  };
  for (const BodyFrame& body : m_.bodies()) {
    if (body.node < 0) continue;
    const size_t i = size_t(body.node);
    const Transform<T> pose = converted<T>(body.pose);
    const Motion<T> V = pose.to_child(w_.V[i]), dV = pose.to_child(dV_[i]);
    T mass = dot(V.v, dV.v);
    Vec3<T> moment = cross(dV.v, V.w) + cross(V.v, dV.w);
    if (!sinking_.empty()) {
      mass = mass + sinking_[i] + dot(dgamma_[i], pose.r);
      moment = moment + pose.R.tmul(dgamma_[i]);
    }
    add(mass);
    for (int k = 0; k < 3; ++k) add(moment[k]);
    const Vec3<T>&w = V.w, &dw = dV.w;
    add(w.x * dw.x);
    add(fma(w.x, dw.y, w.y * dw.x));
    add(fma(w.x, dw.z, w.z * dw.x));
    add(w.y * dw.y);
    add(fma(w.y, dw.z, w.z * dw.y));
    add(w.z * dw.z);
  }
  for (const JointProperties& j : m_.joint_properties())
    add(w_.rate[size_t(j.v)] * w_.mu[size_t(j.v)]);
}

#define PORTHOS_INSTANTIATE(T) template class FieldTangent<T>;
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(phs::Quad)
PORTHOS_INSTANTIATE(phs::Pack4)
PORTHOS_INSTANTIATE(phs::Pack8)
PORTHOS_INSTANTIATE(phs::WideDual)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
