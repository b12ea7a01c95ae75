#pragma once
#include <vector>

#include "mechanics/kinematics.h"
#include "phs/scalars/scalar.h"

/// Jacobians by differentiating poses, without the library's own.
namespace porthos::test {

/// J of a frame at `in_node` of a moving body: its twist [angular; linear] in its own axes is J v.
/// 6 × nv, column-major. Column k: duals through the pose along q' of the unit rate k; Rᵀ R' = [ω
/// ×], Rᵀ r' = the velocity.
inline std::vector<double> frame_jacobian(const mechanics::Mechanism& m,
                                          const std::vector<double>& q, int node,
                                          const mechanics::Pose& in_node) {
  using namespace mechanics;
  using phs::Dual;
  Workspace<Dual> w(m);
  std::vector<double> J, v(size_t(m.nv()), 0.0), q_dot(q.size());
  std::vector<Transform<Dual>> poses(m.nodes().size());
  std::vector<Dual> qd(q.size());
  for (auto& unit : v) {
    unit = 1;
    coordinate_rates<double>(m, q, v, q_dot);
    unit = 0;
    for (size_t i = 0; i < q.size(); ++i) qd[i] = Dual(q[i], q_dot[i]);
    forward_kinematics<Dual>(m, w, qd, poses);
    const auto X =
        poses[size_t(node)] * Transform<Dual>{Mat3<Dual>(in_node.R), Vec3<Dual>(in_node.r)};
    const auto slope = [](const Vec3<Dual>& a, const Vec3<Dual>& b) {
      return a.x.v * b.x.d + a.y.v * b.y.d + a.z.v * b.z.d;
    };
    const auto &x = X.R.x, &y = X.R.y, &z = X.R.z;
    J.insert(J.end(), {slope(z, y), slope(x, z), slope(y, x),  //
                       slope(x, X.r), slope(y, X.r), slope(z, X.r)});
  }
  return J;
}

}  // namespace porthos::test
