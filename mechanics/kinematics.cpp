#include "mechanics/kinematics.h"

#include <algorithm>
#include <cmath>

#include "mechanics/passes-inl.h"

namespace porthos::mechanics {

template <class T>
void forward_kinematics(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<Transform<T>> pose) {
  assert(passes::fits(m, w, q) && passes::sized(pose, m.nodes().size()));
  passes::place_bodies(m, w, q.data());
  for (size_t i = 0; i < m.nodes().size(); ++i) {
    const int parent = m.nodes()[i].parent;
    pose[i] = parent < 0 ? w.X[i] : pose[size_t(parent)] * w.X[i];
  }
}

template <class T>
Transform<T> body_pose(const Mechanism&, const BodyFrame& body,
                       std::span<const Transform<T>> node_pose) {
  const auto own = converted<T>(body.pose);
  return body.node < 0 ? own : node_pose[size_t(body.node)] * own;
}

template <class T>
void jacobian(const Mechanism& m, Workspace<T>& w, std::span<const T> q, const BodyFrame& body,
              JacobianAxes axes, std::span<T> J) {
  assert(passes::fits(m, w, q) && passes::sized(J, 6 * size_t(m.nv())));
  passes::place_bodies(m, w, q.data());
  for (auto& e : J) e = T(0.0);
  Transform<T> X = converted<T>(body.pose);  // pose of the frame in node j, walking to the root
  for (int j = body.node; j >= 0; j = m.nodes()[size_t(j)].parent) {
    const Node& n = m.nodes()[size_t(j)];
    visit_joint(n.type, [&](auto K) {
      unroll<decltype(K)::nv>([&](auto k) {
        Motion<T> S = passes::zero_motion<T>();
        decltype(K)::template add<k>(n, T(1.0), S);
        S = X.to_child(S);
        for (int r = 0; r < 6; ++r) J[size_t(r + 6 * (n.v + k))] = S[r];
      });
    });
    X = w.X[size_t(j)] * X;
  }
  if (axes == JacobianAxes::body) return;
  for (int c = 0; c < m.nv(); ++c) {
    T* col = J.data() + 6 * c;
    const Vec3<T> a = X.R * Vec3<T>{col[0], col[1], col[2]},
                  l = X.R * Vec3<T>{col[3], col[4], col[5]};
    for (int r = 0; r < 3; ++r) {
      col[r] = a[r];
      col[3 + r] = l[r];
    }
  }
}

template <class T>
void coordinate_rates(const Mechanism& m, std::span<const T> q, std::span<const T> v,
                      std::span<T> q_dot) {
  for (const Node& n : m.nodes())
    visit_joint(n.type, [&](auto J) {
      decltype(J)::rates(q.data() + n.q, v.data() + n.v, q_dot.data() + n.q);
    });
}

std::array<double, 4> quaternion_of(const Mat3<double>& R) {
  // Columns x, y, z; the largest of the four squares decides which formula divides.
  const double xx = R.x.x, yy = R.y.y, zz = R.z.z;
  const std::array<double, 4> square{1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz,
                                     1 - xx - yy + zz};
  const auto k = std::max_element(square.begin(), square.end()) - square.begin();
  const double twice = std::sqrt(square[size_t(k)]), f = 0.5 / twice, own = 0.5 * twice;
  const double a = (R.y.z - R.z.y) * f, b = (R.z.x - R.x.z) * f, c = (R.x.y - R.y.x) * f;
  const double xy = (R.x.y + R.y.x) * f, xz = (R.x.z + R.z.x) * f, yz = (R.y.z + R.z.y) * f;
  switch (k) {
    case 0:
      return {own, a, b, c};
    case 1:
      return {a, own, xy, xz};
    case 2:
      return {b, xy, own, yz};
    default:
      return {c, xz, yz, own};
  }
}

#define PORTHOS_INSTANTIATE(T)                                                                     \
  template void forward_kinematics<T>(const Mechanism&, Workspace<T>&, std::span<const T>,         \
                                      std::span<Transform<T>>);                                    \
  template Transform<T> body_pose<T>(const Mechanism&, const BodyFrame&,                           \
                                     std::span<const Transform<T>>);                               \
  template void jacobian<T>(const Mechanism&, Workspace<T>&, std::span<const T>, const BodyFrame&, \
                            JacobianAxes, std::span<T>);                                           \
  template void coordinate_rates<T>(const Mechanism&, std::span<const T>, std::span<const T>,      \
                                    std::span<T>);
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::mechanics
