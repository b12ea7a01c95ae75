#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/functions/motion.h"

/// What closes the loops of a mechanism, as a user says it.
namespace porthos::mechanics {

/// A frame fixed to a link.
struct LinkFrame {
  std::string link;                                ///< any body of the mechanism; empty: the world
  Pose pose{Mat3<double>::identity(), {0, 0, 0}};  ///< in the link's frame; position [m]
};

/// A joint between two links of the tree: frame b moves relative to frame a as the joint allows.
///
/// Types and axes, in the frames a and b (the joint is closed where both frames coincide, except
/// for the freedoms):
///   revolute, continuous  rotation about z
///   prismatic             translation along z
///   cylindrical           both
///   helical               rotation about z with the advance `pitch` along z
///   spherical             any rotation
///   universal             rotations about z of a and then x of b; z_a and x_b stay normal
///   planar                translation along x and y, rotation about z
///   fixed                 nothing
///   on_plane              the origin of b along x and y, any rotation: a point on a plane
///   on_line               the origin of b along z, any rotation
///   on_curve              the origin of b along a curve in the plane z = 0 of a, any rotation
struct LoopJoint {
  std::string name;
  std::string type;
  LinkFrame a, b;
  double pitch = 0;  ///< helical: advance per radian [m/rad]
  /// on_curve: what a smooth curve goes through, [x, y] in a [m] (plane_curve.h). It must not cross
  /// itself.
  std::vector<std::array<double, 2>> points = {};
  bool closed = false;  ///< on_curve: the last point is joined to the first
};

/// Σ factor · coordinate = offset, over coordinates with one freedom: gears, belts, differentials,
/// mimic joints, racks. Angles count their turns.
struct Coupling {
  struct Term {
    std::string coordinate;  ///< name of a coordinate block: "elbow", "lift.slide"
    double factor = 1;
  };
  std::string name;
  std::vector<Term> terms;
  double offset = 0;  ///< in the unit of factor times coordinate
};

/// A massless rod with ball joints: the origins of both frames keep their distance.
struct Rod {
  std::string name;
  LinkFrame a, b;     ///< only the positions count
  double length = 0;  ///< [m], > 0
};

/// A body that rolls or slides on the plane z = 0 of the frame `ground`, without slip.
///
/// Types, by the frame `wheel` of the body:
///   disk     a thin disk about the origin with the axle z touches the plane and does not slip
///   sphere   a ball about the origin touches the plane and does not slip; it may spin
///   blade    the origin does not move along z: a skate's edge, a wheel seen from above
///   no_spin  the body does not turn about z (Suslov's constraint)
struct Rolling {
  std::string name;
  std::string type;
  LinkFrame ground, wheel;
  double radius = 0;  ///< disk, sphere: [m], > 0
};

/// A coordinate with one freedom that moves as told: a motor of any strength.
struct Driven {
  std::string name;
  std::string coordinate;
  phs::Motion motion;  ///< angles count their turns
};

/// Everything that constrains a mechanism besides its tree.
struct ConstraintSpec {
  std::vector<LoopJoint> loops;
  std::vector<Rod> rods;
  std::vector<Coupling> couplings;
  std::vector<Rolling> rollings = {};
  std::vector<Driven> driven = {};

  bool empty() const {
    return loops.empty() && rods.empty() && couplings.empty() && rollings.empty() && driven.empty();
  }
};

}  // namespace porthos::mechanics
