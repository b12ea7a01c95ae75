#include "space/link_forces.h"

#include "mechanics/passes-inl.h"
#include "mechanics/rotation.h"

namespace porthos::space {

using namespace mechanics;

template <class T>
LinkForces<T>::LinkForces(const Mechanism& m)
    : m_(m), w_(m), pose_(m.nodes().size()), force_(size_t(m.nv())) {
  bool floats = !m.nodes().empty() && m.nodes()[0].q == 0;
  for (const Node& n : m.nodes()) {
    if (n.parent < 0)
      visit_joint(n.type, [&](auto J) { floats = floats && decltype(J)::name == "free"; });
    Link link{n.inertia.m, {0, 0, 0}, n.inertia.I};
    if (link.m > 0) {
      link.c = (1 / link.m) * n.inertia.mc;
      const Vec3d& c = link.c;
      link.I = n.inertia.I + Sym3<double>{-link.m * (c.y * c.y + c.z * c.z),
                                          link.m * c.x * c.y,
                                          link.m * c.x * c.z,
                                          -link.m * (c.x * c.x + c.z * c.z),
                                          link.m * c.y * c.z,
                                          -link.m * (c.x * c.x + c.y * c.y)};
    }
    links_.push_back(link);
  }
  if (!floats)
    throw InvalidArgument("mechanism '" + m.name() +
                          "' does not float freely: in orbit bodies on a free base, or free "
                          "themselves, are expected");
  if (m.has_gravity())
    throw InvalidArgument("mechanism '" + m.name() +
                          "' has uniform gravity: in orbit that of the planet is expected alone");
}

template <class T>
void LinkForces<T>::set_turn_angles(std::span<const T> angles) {
  std::copy(angles.begin(), angles.end(), w_.turn_angle.begin());
}

template <class T>
void LinkForces<T>::place(std::span<const T> q) {
  passes::place_bodies(m_, w_, q.data());
  base_ = rotation_matrix(Quaternion<T>::load(q.data() + base_attitude));
  const auto& nodes = m_.nodes();
  const Vec3<T> zero{T(0.0), T(0.0), T(0.0)};
  Vec3<T> sum = zero;
  double mass = 0;
  for (size_t i = 0; i < nodes.size(); ++i) {
    w_.g[i] = {zero, zero};
    if (i == 0) {
      pose_[i] = {Mat3<T>::identity(), zero};
    } else if (nodes[i].parent < 0) {  // another tree, relative to the base
      const auto& X = w_.X[i];
      pose_[i] = {{base_.tmul(X.R.x), base_.tmul(X.R.y), base_.tmul(X.R.z)},
                  base_.tmul(X.r - w_.X[0].r)};
    } else {
      pose_[i] = pose_[size_t(nodes[i].parent)] * w_.X[i];
    }
    const Link& k = links_[i];
    if (k.m == 0) continue;
    mass += k.m;
    sum += T(k.m) * (pose_[i].R * Vec3<T>(k.c) + pose_[i].r);
  }
  centre_ = (T(1.0) / T(mass)) * sum;
}

template <class T>
void LinkForces<T>::project() {
  const auto& nodes = m_.nodes();
  const auto put = [&](size_t at, const Vec3<T>& n, const Vec3<T>& f) {
    force_[at] = n.x;
    force_[at + 1] = n.y;
    force_[at + 2] = n.z;
    force_[at + 3] = f.x;
    force_[at + 4] = f.y;
    force_[at + 5] = f.z;
  };
  Vec3<T> others{T(0.0), T(0.0), T(0.0)}, about = others;  // of all trees but the base's
  for (size_t i = nodes.size(); i-- > 0;) {
    const Node& n = nodes[i];
    auto& g = w_.g[i];
    if (i == 0) {
      // The sum of all forces is zero up to rounding; the remainder acts at the centre of mass and
      // is dropped.
      const Vec3<T> rest = g.f + others;
      const Vec3<T> t = g.n - cross(centre_, rest);
      put(size_t(n.v), t, -others);
      torque_ = base_ * (t + cross(centre_, others) + about);
    } else if (n.parent < 0) {
      put(size_t(n.v), g.n, g.f);
      const Vec3<T> f = pose_[i].R * g.f;
      others += f;
      about += pose_[i].R * g.n + cross(pose_[i].r - centre_, f);
    } else {
      visit_joint(n.type, [&](auto J) {
        unroll<decltype(J)::nv>(
            [&](auto c) { force_[size_t(n.v + c)] = decltype(J)::template project<c>(n, g); });
      });
      w_.g[size_t(n.parent)] += w_.X[i].to_parent(g);
    }
  }
}

template <class T>
void LinkForces<T>::momentum_rates(std::span<const T> q, std::span<T> p_dot) const {
  const auto& nodes = m_.nodes();
  for (const Node& n : nodes)
    visit_joint(n.type, [&](auto J) {
      const T* f = force_.data() + n.v;
      T* out = p_dot.data() + n.q;
      if constexpr (decltype(J)::lifted)
        decltype(J)::lift(q.data() + n.q, f, out);
      else
        for (int k = 0; k < decltype(J)::nv; ++k) out[k] = f[k];
    });
  for (size_t k = 0; k < 3; ++k) {
    T sum(0.0);
    for (const Node& n : nodes)
      if (n.parent < 0 && n.q != 0) sum = sum + p_dot[size_t(n.q) + k];
    p_dot[base_position + k] = -sum;
  }
}

#define PORTHOS_INSTANTIATE(T) template class LinkForces<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::space
