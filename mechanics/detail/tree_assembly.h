#pragma once
#include <vector>

#include "mechanics/builder.h"

namespace porthos::mechanics {

/// The parts of a Mechanism that derive from its bodies and joints.
struct AssembledTree {
  std::vector<Node> nodes;
  std::vector<JointCoordinates> coordinates;
  std::vector<BodyFrame> bodies;
  std::vector<JointProperties> properties;
  std::vector<Remark> remarks;
  int nq = 0, nv = 0, angles = 0;
};

/// Builds them from bodies in an order where each comes after its parent. @throws InvalidArgument
/// as MechanismBuilder::build()
AssembledTree assemble_tree(const std::vector<const BodySpec*>& order, bool accept_unphysical);

/// A rotation whose z axis is `axis`; exact for axes along x, y, z.
Mat3<double> frame_with_z(const Vec3d& axis);

}  // namespace porthos::mechanics
