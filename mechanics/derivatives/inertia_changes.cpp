#include "mechanics/inertia.h"
#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// A rigid inertia in another frame is linear in its ten numbers.
InertiaChanges inertia_changes(const Mechanism& m, std::span<const double> numbers) {
  const auto& nodes = m.nodes();
  InertiaChanges all;
  all.inertia_change.assign(nodes.size(), {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}});
  const double* d = numbers.data();
  for (const BodyFrame& body : m.bodies()) {
    if (body.node < 0) continue;
    const RigidInertia<double> own{d[0], {d[1], d[2], d[3]}, {d[4], d[5], d[6], d[7], d[8], d[9]}};
    const auto moved = to_parent(body.pose, own);
    auto& sum = all.inertia_change[size_t(body.node)];
    sum = {sum.m + moved.m, sum.mc + moved.mc, sum.I + moved.I};
    d += 10;
  }
  all.subtree_mass_change.assign(nodes.size(), 0.0);
  for (size_t i = nodes.size(); i-- > 0;) {
    all.subtree_mass_change[i] += all.inertia_change[i].m;
    if (nodes[i].parent >= 0)
      all.subtree_mass_change[size_t(nodes[i].parent)] += all.subtree_mass_change[i];
  }
  all.rotor_inertia_change.assign(size_t(m.nv()), 0.0);
  for (const JointProperties& j : m.joint_properties())
    all.rotor_inertia_change[size_t(j.v)] = *d++;
  return all;
}

}  // namespace porthos::mechanics
