#include "planning/detail/whole_body_parts.h"

#include <algorithm>
#include <cmath>

namespace porthos::planning::detail {

using mechanics::Vec3d;

Cone make_cone(const mechanics::Mechanism& m, const ContactPoint& p) {
  const std::string who = "the contact '" + p.name + "'";
  Cone c;
  c.frame = m.body(p.body);
  if (c.frame.node < 0) throw InvalidArgument(who + " is on '" + p.body + "', which never moves");
  const double length = mechanics::norm(p.normal);
  if (!(length > 0) || !std::isfinite(length) || !mechanics::finite(p.position))
    throw InvalidArgument(who + " needs a normal of positive length and a finite position");
  if (!(p.friction >= 0) || !(p.least >= 0) || !(p.most >= p.least))
    throw InvalidArgument(who + " needs friction ≥ 0 and 0 ≤ least ≤ most");
  if (p.edges < 3) throw InvalidArgument(who + " needs a pyramid of 3 edges or more");
  c.frame.pose.r = c.frame.pose.R * p.position + c.frame.pose.r;
  c.normal = (1 / length) * p.normal;
  const auto& n = c.normal;
  const Vec3d aside = std::fabs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d along = aside - mechanics::dot(aside, n) * n;
  c.across[0] = (1 / mechanics::norm(along)) * along;
  c.across[1] = mechanics::cross(n, c.across[0]);
  return c;
}

std::vector<const mechanics::JointCoordinates*> single_freedoms(const mechanics::Mechanism& m) {
  std::vector<const mechanics::JointCoordinates*> single;
  for (const auto& c : m.coordinates()) {
    const auto of_joint = [&](const auto& other) { return other.joint == c.joint; };
    if (c.nv == 1 && std::count_if(m.coordinates().begin(), m.coordinates().end(), of_joint) == 1)
      single.push_back(&c);
  }
  return single;
}

std::vector<LimitedJoint> limited_joints(const mechanics::Mechanism& m,
                                         const std::vector<JointLimit>& limits) {
  std::vector<LimitedJoint> joints;
  const auto known = single_freedoms(m);
  for (const auto& l : limits) {
    const auto& p = *find_named(known, l.joint, "there is no joint of one degree of freedom",
                                [](const auto* c) -> const std::string& { return c->joint; });
    for (const auto& other : joints)
      if (other.v == p.v) throw InvalidArgument("the joint '" + l.joint + "' has limits twice");
    if (!(l.torque >= 0) || !(l.rate >= 0) || !(l.lower <= l.upper))
      throw InvalidArgument("the joint '" + l.joint +
                            "' needs limits of torque and rate ≥ 0 and lower ≤ upper");
    joints.push_back({l, p.q, p.v});
  }
  return joints;
}

}  // namespace porthos::planning::detail
