#include "space/gravity_gradient.h"

#include "mechanics/passes-inl.h"
#include "mechanics/rotation.h"

namespace porthos::space {

using namespace mechanics;

namespace {

/// m (|c|² 1 - c cᵀ)
template <class T>
Sym3<T> point_inertia(T m, const Vec3<T>& c) {
  return {m * (c.y * c.y + c.z * c.z), -(m * c.x * c.y), -(m * c.x * c.z),
          m * (c.x * c.x + c.z * c.z), -(m * c.y * c.z), m * (c.x * c.x + c.y * c.y)};
}
template <class T>
T trace(const Sym3<T>& I) {
  return I.xx + I.yy + I.zz;
}

}  // namespace

template <class T>
GravityGradient<T>::GravityGradient(const Mechanism& m)
    : m_(m), w_(m), pose_(m.nodes().size()), force_(size_t(m.nv())) {
  int roots = 0;
  bool free_base = false;
  for (const Node& n : m.nodes()) {
    if (n.parent < 0)
      ++roots, visit_joint(n.type, [&](auto J) { free_base = decltype(J)::name == "free"; });
    Link link{n.inertia.m, {0, 0, 0}, n.inertia.I};
    if (link.m > 0) {
      link.c = (1 / link.m) * n.inertia.mc;
      const auto shift = point_inertia(link.m, link.c);
      link.I = n.inertia.I +
               Sym3<double>{-shift.xx, -shift.xy, -shift.xz, -shift.yy, -shift.yz, -shift.zz};
    }
    links_.push_back(link);
  }
  if (roots != 1 || !free_base || m.nodes()[0].q != 0)
    throw InvalidArgument("mechanism '" + m.name() +
                          "' does not float freely: in orbit one tree of bodies on a free base is "
                          "expected");
  if (m.has_gravity())
    throw InvalidArgument("mechanism '" + m.name() +
                          "' has uniform gravity: in orbit that of the planet is expected alone");
}

template <class T>
void GravityGradient<T>::set_turn_angles(std::span<const T> angles) {
  std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
}

template <class T>
void GravityGradient<T>::place(std::span<const T> q) {
  passes::place_bodies(m_, w_, q.data());
  const auto& nodes = m_.nodes();
  Vec3<T> sum{T(0.0), T(0.0), T(0.0)};
  double mass = 0;
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].parent < 0)
      pose_[i] = {Mat3<T>::identity(), {T(0.0), T(0.0), T(0.0)}};
    else
      pose_[i] = pose_[size_t(nodes[i].parent)] * w_.X[i];
    const Link& k = links_[i];
    if (k.m == 0) continue;
    mass += k.m;
    sum += T(k.m) * (pose_[i].R * Vec3<T>(k.c) + pose_[i].r);
  }
  centre_ = (T(1.0) / T(mass)) * sum;
}

template <class T>
void GravityGradient<T>::evaluate(double mu, std::span<const T> q, const Vec3<T>& R) {
  place(q);
  const Mat3<T> base = rotation_matrix(Quaternion<T>::load(q.data() + base_attitude));
  const T inverse = T(1.0) / norm(R);
  const T k = T(mu) * inverse * inverse * inverse;
  const Vec3<T> u = base.tmul(inverse * R);  // in the base's axes
  const auto& nodes = m_.nodes();
  T trace_I(0.0);
  Vec3<T> I_u{T(0.0), T(0.0), T(0.0)};
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Link& link = links_[i];
    const Mat3<T>& A = pose_[i].R;
    const Vec3<T> u_i = A.tmul(u), c(link.c);
    const Sym3<T> I(link.I);
    const Vec3<T> I_ui = I * u_i;
    trace_I = trace_I + trace(I);
    Vec3<T> f{T(0.0), T(0.0), T(0.0)};
    I_u += A * I_ui;
    if (link.m > 0) {
      const T m(link.m);
      const Vec3<T> r = A.tmul(pose_[i].r - centre_) + c;  // from the common centre, link's axes
      const T s = dot(r, u_i), r2 = dot(r, r);
      trace_I = trace_I + T(2.0) * m * r2;
      I_u += A * (m * (r2 * u_i - s * r));
      f = (m * k) * (T(3.0) * s * u_i - r);
    }
    w_.g[i] = {(T(3.0) * k) * cross(u_i, I_ui) + cross(c, f), f};
  }
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    if (n.parent < 0) {
      // About the centre of mass; the forces sum to rounding, which is not let into the translation.
      const Vec3<T> t = w_.g[i].n - cross(centre_, w_.g[i].f);
      const size_t at = size_t(n.v);
      force_[at] = t.x, force_[at + 1] = t.y, force_[at + 2] = t.z;
      for (size_t j = 3; j < 6; ++j) force_[at + j] = T(0.0);
      torque_ = base * t;
      continue;
    }
    visit_joint(n.type, [&](auto J) {
      unroll<decltype(J)::nv>(
          [&](auto c) { force_[size_t(n.v + c)] = decltype(J)::template project<c>(n, w_.g[i]); });
    });
    w_.g[size_t(n.parent)] += w_.X[i].to_parent(w_.g[i]);
  }
  const T uIu = dot(u, I_u);
  energy_ = T(-0.5) * k * (trace_I - T(3.0) * uIu);
  const T scale = T(-1.5) * k * inverse;
  reaction_ = base * (scale * ((trace_I - T(5.0) * uIu) * u + T(2.0) * I_u));
}

template <class T>
void GravityGradient<T>::momentum_rates(std::span<const T> q, std::span<T> p_dot) const {
  for (const Node& n : m_.nodes())
    visit_joint(n.type, [&](auto J) {
      const T* f = force_.data() + n.v;
      T* out = p_dot.data() + n.q;
      if constexpr (decltype(J)::lifted)
        decltype(J)::lift(q.data() + n.q, f, out);
      else
        for (int k = 0; k < decltype(J)::nv; ++k) out[k] = f[k];
    });
}

template <class T>
T GravityGradient<T>::next_order(double mu, std::span<const T> q, const Vec3<T>& R) {
  place(q);
  const Mat3<T> base = rotation_matrix(Quaternion<T>::load(q.data() + base_attitude));
  const T d2 = dot(R, R), d = norm(R);
  const Vec3<T> u = base.tmul(R);
  T sum(0.0);
  for (size_t i = 0; i < links_.size(); ++i) {
    const Link& link = links_[i];
    const Mat3<T>& A = pose_[i].R;
    const Vec3<T> n = (T(1.0) / d) * A.tmul(u);
    const Vec3<T> r = A.tmul(pose_[i].r - centre_) + Vec3<T>(link.c);
    const Sym3<T> I(link.I);
    const T half = T(0.5) * trace(I), s = dot(r, n), m(link.m);  // J = half 1 - I: second moments
    const T nJn = half - dot(n, I * n), nJr = half * s - dot(n, I * r);
    sum = sum + T(5.0) * (m * s * s * s + T(3.0) * s * nJn) -
          T(3.0) * (m * s * dot(r, r) + s * half + T(2.0) * nJr);
  }
  return T(0.5 * mu) / (d2 * d2) * sum;  // of 1/|R + r|: its odd orders are negative
}

#define PORTHOS_INSTANTIATE(T) template class GravityGradient<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::space
