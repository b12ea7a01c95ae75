#include "mechanics/momentum.h"

#include "mechanics/kinematics.h"
#include "mechanics/passes-inl.h"

namespace porthos::mechanics {
namespace {

/// Leaf → root: w.b_i = momentum of the subtree of i (twists must be set).
template <class T>
void subtree_momenta(const Mechanism& m, Workspace<T>& w) {
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) w.b[i] = passes::rigid<T>(nodes[i]) * w.V[i];
  for (size_t i = nodes.size(); i-- > 0;)
    if (nodes[i].parent >= 0)
      w.b[size_t(nodes[i].parent)] += passes::to_parent<void>(nodes[i], w, i, w.b[i]);
}

}  // namespace

template <class T>
void momenta_from_rates(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<const T> v, std::span<T> p) {
  assert(passes::fits(m, w, q) && passes::sized(v, size_t(m.nv())) && passes::sized(p, q.size()));
  passes::place_bodies(m, w, q.data());
  passes::twists(m, w, v.data());
  subtree_momenta(m, w);
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const Node& n = m.nodes()[i];
    visit_joint(n.type, [&](auto J) {
      T mu[decltype(J)::nv];
      unroll<decltype(J)::nv>([&](auto k) { mu[k] = decltype(J)::template project<k>(n, w.b[i]); });
      if constexpr (decltype(J)::nv == 1)
        if (n.rotor_inertia != 0) mu[0] = mu[0] + T(n.rotor_inertia) * v[size_t(n.v)];
      decltype(J)::lift(q.data() + n.q, mu, p.data() + n.q);
    });
  }
}

template <class T>
Momentum<T> momentum(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                     std::span<const T> p) {
  const Vec3<T> zero{T(0.0), T(0.0), T(0.0)};
  Momentum<T> sum{zero, zero};
  bool computed = false;
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const Node& n = m.nodes()[i];
    if (n.parent >= 0) continue;
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      if constexpr (std::is_same_v<Joint, Free>) {
        // In the root's placement L = ½ Im(π ξ̄) + x × P; then the placement itself.
        const T *x = q.data() + n.q, *y = p.data() + n.q;
        const auto xi = Quaternion<T>::load(x + 3), pi = Quaternion<T>::load(y + 3);
        const Vec3<T> r{x[0], x[1], x[2]}, P{y[0], y[1], y[2]};
        const Vec3<T> L = T(0.5) * (xi.w * pi.v - pi.w * xi.v - cross(pi.v, xi.v)) + cross(r, P);
        const Mat3<T> R(n.placement.R);
        const Vec3<T> P_world = R * P;
        sum.linear += P_world;
        sum.angular += R * L + cross(Vec3<T>(n.placement.r), P_world);
      } else {
        if (!computed) {
          rates_from_momenta(m, w, q, p);
          subtree_momenta(m, w);
          computed = true;
        }
        const Force<T> h = w.X[i].to_parent(w.b[i]);
        sum.linear += h.f;
        sum.angular += h.n;
      }
    });
  }
  return sum;
}

template <class T>
void centroidal_momentum_matrix(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                                std::span<T> A) {
  // Column j: the total momentum for a unit rate of freedom j, equal to that of the subtree it
  // moves.
  const auto& nodes = m.nodes();
  passes::place_bodies(m, w, q.data());
  for (size_t i = 0; i < nodes.size(); ++i) w.A[i] = ArticulatedInertia<T>(nodes[i].inertia);
  for (size_t i = nodes.size(); i-- > 0;)
    if (nodes[i].parent >= 0) w.A[size_t(nodes[i].parent)] += to_parent(w.X[i], w.A[i]);
  Vec3<T> first_moment{T(0.0), T(0.0), T(0.0)};
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node& n = nodes[i];
    visit_joint(n.type, [&](auto J) {
      unroll<decltype(J)::nv>([&](auto k) {
        Motion<T> S = passes::zero_motion<T>();
        decltype(J)::template add<k>(n, T(1.0), S);
        Force<T> h = w.A[i] * S;
        for (int j = int(i); j >= 0; j = nodes[size_t(j)].parent) h = w.X[size_t(j)].to_parent(h);
        for (int r = 0; r < 6; ++r) A[size_t(r + 6 * (n.v + k))] = h[r];
      });
    });
    if (n.parent < 0) {
      const Vec3<T> mc{w.A[i].H.y.z, w.A[i].H.z.x, w.A[i].H.x.y};  // H = (m c)×
      first_moment += w.A[i].M.xx * w.X[i].r + w.X[i].R * mc;
    }
  }
  const Vec3<T> c = (T(1.0) / T(m.total_mass())) * first_moment;
  for (int j = 0; j < m.nv(); ++j) {
    T* col = A.data() + 6 * j;
    const Vec3<T> shift = cross(c, Vec3<T>{col[3], col[4], col[5]});
    for (int r = 0; r < 3; ++r) col[r] = col[r] - shift[r];
  }
}

template <class T>
Vec3<T> centre_of_mass(const Mechanism& m, Workspace<T>& w, std::span<const T> q) {
  const auto& nodes = m.nodes();
  passes::place_bodies(m, w, q.data());
  Vec3<T> sum{T(0.0), T(0.0), T(0.0)};
  for (size_t i = 0; i < nodes.size(); ++i)
    w.g[i] = {Vec3<T>(nodes[i].inertia.mc), {T(nodes[i].inertia.m), T(0.0), T(0.0)}};
  for (size_t i = nodes.size(); i-- > 0;) {  // first moment and mass of each subtree
    const T mass = w.g[i].f.x;
    const Vec3<T> mc = w.X[i].R * w.g[i].n + mass * w.X[i].r;
    if (nodes[i].parent < 0) {
      sum += mc;
    } else {
      auto& above = w.g[size_t(nodes[i].parent)];
      above.n += mc;
      above.f.x = above.f.x + mass;
    }
  }
  return (T(1.0) / T(m.total_mass())) * sum;
}

template <class T>
T kinetic_energy(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> p) {
  rates_from_momenta(m, w, q, p);
  T sum(0.0);
  for (size_t j = 0; j < w.rate.size(); ++j) sum = sum + w.rate[j] * w.mu[j];
  return T(0.5) * sum;
}

template <class T>
T base_kinetic_energy(const Mechanism& m, const Workspace<T>& w) {
  T twice(0.0);
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const Node& n = m.nodes()[i];
    visit_joint(n.type, [&](auto J) {
      if constexpr (std::is_same_v<decltype(J), Free>) {
        const Force<T> h = passes::rigid<T>(n) * w.V[i];
        twice = twice + dot(w.V[i].w, h.n) + dot(w.V[i].v, h.f);
      }
    });
  }
  return T(0.5) * twice;
}

template <class T>
T potential_energy(const Mechanism& m, Workspace<T>& w, std::span<const T> q) {
  if (!m.has_gravity()) return T(0.0);
  return -T(m.total_mass()) * dot(Vec3<T>(m.gravity()), centre_of_mass(m, w, q));
}

MomentumScale momentum_scale(const Mechanism& m, Workspace<double>& w, std::span<const double> q,
                             std::span<const double> v) {
  struct Particle {
    double mass;
    Vec3d c, v;
  };
  std::vector<Particle> bodies;
  std::vector<Pose> pose(m.nodes().size());
  forward_kinematics<double>(m, w, q, pose);
  passes::twists(m, w, v.data());
  const Vec3d from =
      pose.empty() ? Vec3d{0, 0, 0} : pose[0].r;  // keeps differences exact far from the origin
  MomentumScale s{0, 0};
  Particle all{0, {0, 0, 0}, {0, 0, 0}};
  for (size_t i = 0; i < pose.size(); ++i) {
    const auto& I = m.nodes()[i].inertia;
    if (I.m <= 0) continue;
    const Vec3d c = (1 / I.m) * I.mc;
    const Vec3d speed = pose[i].R * (w.V[i].v + cross(w.V[i].w, c));
    bodies.push_back({I.m, (pose[i].r - from) + pose[i].R * c, speed});
    all.mass += I.m;
    all.c += I.m * bodies.back().c;
    all.v += I.m * speed;
    s.linear += I.m * norm(speed);
    s.angular += norm(w.V[i].w) * std::sqrt(I.I.xx * I.I.xx + I.I.yy * I.I.yy + I.I.zz * I.I.zz);
  }
  for (const Particle& b : bodies)
    s.angular += b.mass * norm(b.c - (1 / all.mass) * all.c) * norm(b.v - (1 / all.mass) * all.v);
  return s;
}

#define PORTHOS_INSTANTIATE(T)                                                                     \
  template void momenta_from_rates<T>(const Mechanism&, Workspace<T>&, std::span<const T>,         \
                                      std::span<const T>, std::span<T>);                           \
  template Momentum<T> momentum<T>(const Mechanism&, Workspace<T>&, std::span<const T>,            \
                                   std::span<const T>);                                            \
  template void centroidal_momentum_matrix<T>(const Mechanism&, Workspace<T>&, std::span<const T>, \
                                              std::span<T>);                                       \
  template Vec3<T> centre_of_mass<T>(const Mechanism&, Workspace<T>&, std::span<const T>);         \
  template T kinetic_energy<T>(const Mechanism&, Workspace<T>&, std::span<const T>,                \
                               std::span<const T>);                                                \
  template T base_kinetic_energy<T>(const Mechanism&, const Workspace<T>&);                        \
  template T potential_energy<T>(const Mechanism&, Workspace<T>&, std::span<const T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
