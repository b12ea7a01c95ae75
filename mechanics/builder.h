#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// Mass properties of a body as users give them.
struct MassProperties {
  double mass = 0;     ///< [kg]
  Vec3d com{0, 0, 0};  ///< centre of mass in the body frame [m]
  Sym3<double> inertia{0, 0, 0, 0,
                       0, 0};  ///< about the centre of mass, along `axes` [kg m²], tensor elements
  Mat3<double> axes = Mat3<double>::identity();  ///< inertia axes in the body frame
};

/// A joint as users give it.
struct JointSpec {
  std::string name;            ///< empty: the body's name
  std::string type = "fixed";  ///< one of joint_type_names()
  Vec3d axis{0, 0, 1};  ///< in the joint frame; need not be unit. Ignored by spherical and free
  /// universal: second rotation axis; planar: first translation (its part in the plane)
  std::optional<Vec3d> second_axis;
  double pitch = 0;  ///< helical [m/rad]
  double damping = 0, stiffness = 0, rest = 0,
         friction = 0;  ///< see JointProperties; joints of one freedom only
  std::optional<double> lower, upper;
  /// Rotor (armature) inertia [kg m² | kg], >= 0; joints of one freedom only: n² J of a rotor of
  /// inertia J behind a gear of ratio n, as the joint feels it. It adds ½ n²J q̇² to the energy,
  /// n²J q̇ to the joint's momentum and n²J to its entry of the mass matrix. Neglected, as usual:
  /// the gyroscopic moment of the spinning rotor on the link that carries it, the terms in n J, n
  /// times smaller. Its mass, and its J at rest in that link, belong in the link's own mass
  /// properties. Source: Featherstone 2008, section 9.6.
  double rotor_inertia = 0;
  std::string where;  ///< "file:line" for messages; empty: the body's
};

/// A body, the joint that carries it and where the joint sits.
struct BodySpec {
  std::string name;
  std::string parent;  ///< name of another body, or "world"
  JointSpec joint;
  Pose placement{Mat3<double>::identity(),
                 {0, 0, 0}};  ///< joint frame (= body frame at q = 0) in the parent's body frame
  MassProperties mass;
  std::string where;  ///< "file:line" for messages, may be empty
};

/// Something that moves has no mass. Two ways out: mass properties for one of the links, or the
/// joint locked.
struct MasslessPart : InvalidArgument {
  MasslessPart(const std::string& text, std::string mover, std::vector<std::string> massless)
      : InvalidArgument(text), joint(std::move(mover)), links(std::move(massless)) {}
  std::string joint;               ///< the one that moves it
  std::vector<std::string> links;  ///< those without mass
};

/// The outermost joint with a freedom that moves no inertia at the configuration q; none: the
/// mechanism is sound there.
std::optional<std::string> joint_without_inertia(const Mechanism& m, std::span<const double> q);

/// Collects bodies in any order, validates, and makes the immutable Mechanism.
class MechanismBuilder {
 public:
  explicit MechanismBuilder(std::string name = "mechanism") : name_(std::move(name)) {}
  MechanismBuilder& add(BodySpec body);
  /// What has been added, to be changed before another build().
  std::vector<BodySpec>& bodies() { return bodies_; }
  const std::vector<BodySpec>& bodies() const { return bodies_; }
  MechanismBuilder& gravity(const Vec3d& g);
  /// Takes inertias that are positive but break the triangle inequality, as some published robots
  /// have; each becomes a remark of the mechanism. Off by default.
  MechanismBuilder& accept_unphysical_inertia(bool accept);

  /// @throws InvalidArgument naming the offender (and file:line if known): duplicate or unknown
  ///   names, a cycle, a negative or non-finite mass, an inertia that is not positive or breaks the
  ///   triangle inequality, a zero axis, an unknown joint type, negative damping or stiffness;
  ///   MasslessPart for a joint that moves no inertia at any configuration tried.
  Mechanism build() const;

 private:
  std::string name_;
  std::vector<BodySpec> bodies_;
  Vec3d gravity_{0, 0, 0};
  bool accept_unphysical_ = false;
};

/// The rotation matrix of URDF's roll-pitch-yaw: Rz(yaw) Ry(pitch) Rx(roll), rounded once.
Mat3<double> rotation_from_rpy(double roll, double pitch, double yaw);

}  // namespace porthos::mechanics
