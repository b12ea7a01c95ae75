#pragma once
#include "planning/whole_body.h"

/// What WholeBody keeps of its options.
namespace porthos::planning::detail {

/// A contact with two unit vectors across its normal.
struct Cone {
  mechanics::BodyFrame frame;
  mechanics::Vec3d across[2], normal;
};

/// A joint with what it may do.
struct LimitedJoint {
  JointLimit limit;
  int q, v;
};

/// The joints of one freedom: those that can have a motor and limits.
std::vector<const mechanics::JointCoordinates*> single_freedoms(const mechanics::Mechanism& m);
/// @throws InvalidArgument as WholeBody()
Cone make_cone(const mechanics::Mechanism& m, const ContactPoint& p);
std::vector<LimitedJoint> limited_joints(const mechanics::Mechanism& m,
                                         const std::vector<JointLimit>& limits);

}  // namespace porthos::planning::detail
