#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/kinematics.h"
#include "mechanics/reconfiguration.h"
#include "mechanics/rotation.h"
#include "phs/scalars/scalar.h"

/// The state that reconfigurations and changes of coordinates compute with.
namespace porthos::mechanics {

/// A mechanism at one instant, in 113 bits.
struct Instant {
  using Real = phs::Quad;
  using Reals = std::vector<Real>;
  const Mechanism& m;
  Workspace<Real> w;
  Reals q, p, v;
  std::vector<Transform<Real>> nodes;

  Instant(const MechanicalModel& model, const phs::State& s)
      : m(model.mechanism()),
        w(m),
        q(size_t(m.nq())),
        p(q.size()),
        v(size_t(m.nv())),
        nodes(m.nodes().size()) {
    for (size_t i = 0; i < q.size(); ++i) {
      q[i] = Real(s.x[i]) + Real(s.lo[i]);
      p[i] = Real(s.x[q.size() + i]) + Real(s.lo[q.size() + i]);
    }
    size_t turn = 0;
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::angle)
        q[size_t(b.at)] +=
            Real(double(s.turns[turn++])) * (Real(phs::two_pi_hi) + Real(phs::two_pi_lo));
    place();
    rates_from_momenta<Real>(m, w, q, p);
    v = w.rate;
    momenta_from_rates<Real>(m, w, q, v, p);  // leaves the twists
  }
  void place() { forward_kinematics<Real>(m, w, q, nodes); }
  /// Of a body in the world; "": of the world itself.
  Transform<Real> pose(const std::string& body) const {
    if (body.empty()) return lifted(Pose{Mat3<double>::identity(), {0, 0, 0}});
    return body_pose<Real>(m, m.body(body), nodes);
  }
  Motion<Real> twist(const std::string& body) const {
    const Vec3<Real> none{Real(0), Real(0), Real(0)};
    if (body.empty() || m.body(body).node < 0) return {none, none};
    const auto& b = m.body(body);
    return lifted(b.pose).to_child(w.V[size_t(b.node)]);
  }
  static Vec3<Real> lifted(const Vec3d& a) { return {Real(a.x), Real(a.y), Real(a.z)}; }
  static Transform<Real> lifted(const Pose& x) { return {Mat3<Real>(x.R), lifted(x.r)}; }
};

inline Vec3d lowered(const Vec3<phs::Quad>& a) { return {double(a.x), double(a.y), double(a.z)}; }
inline Pose lowered(const Transform<phs::Quad>& x) {
  return {{lowered(x.R.x), lowered(x.R.y), lowered(x.R.z)}, lowered(x.r)};
}
inline Transform<phs::Quad> inverse(const Transform<phs::Quad>& x) {
  const auto& R = x.R;
  const Mat3<phs::Quad> T{{R.x.x, R.y.x, R.z.x}, {R.x.y, R.y.y, R.z.y}, {R.x.z, R.y.z, R.z.z}};
  return {T, -(T * x.r)};
}
/// The unit quaternion of a rotation matrix, from its largest component. Source: Shepperd 1978.
inline Quaternion<phs::Quad> quaternion(const Mat3<phs::Quad>& R) {
  using Real = phs::Quad;
  const Real d[4] = {R.x.x + R.y.y + R.z.z, R.x.x, R.y.y, R.z.z};
  const int k = int(std::max_element(d, d + 4) - d);
  Real q[4];
  const auto R_at = [&](int i, int j) { return (j == 0 ? R.x : j == 1 ? R.y : R.z)[i]; };
  if (k == 0) {
    q[0] = 1 + d[0];
    q[1] = R_at(2, 1) - R_at(1, 2);
    q[2] = R_at(0, 2) - R_at(2, 0);
    q[3] = R_at(1, 0) - R_at(0, 1);
  } else {
    const int i = k - 1, j = (i + 1) % 3, l = (i + 2) % 3;
    q[0] = R_at(l, j) - R_at(j, l);
    q[1 + i] = 1 + 2 * d[k] - d[0];
    q[1 + j] = R_at(j, i) + R_at(i, j);
    q[1 + l] = R_at(l, i) + R_at(i, l);
  }
  const Real size = phs::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (Real& x : q) x /= size;
  return Quaternion<Real>::load(q);
}
inline double length(const Vec3<phs::Quad>& a) { return double(phs::sqrt(dot(a, a))); }

using LockedJoints = std::map<std::string, LockedJoint>;

/// Replaces the mechanism by the next one: positions, rates and the ledger of the event, see
/// reconfiguration.h. locked: the joints that are then.
Impact change(MovingMechanism& moving, MechanismBuilder next, ConstraintSpec loops,
              LockedJoints locked);
/// The same with the joints that are locked now.
inline Impact change(MovingMechanism& moving, MechanismBuilder next, ConstraintSpec loops) {
  return change(moving, std::move(next), std::move(loops), moving.locked);
}
/// The constraints of the joints that are free: the values of locked ones go to the offsets of
/// couplings.
ConstraintSpec without_locked(ConstraintSpec all, const LockedJoints& locked);
/// The value of a coordinate of a locked joint, or null.
const phs::Quad* locked_value(const LockedJoints& locked, const std::string& coordinate);

}  // namespace porthos::mechanics
