#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// Mass properties of a body, as given by the user.
struct MassProperties {
  double mass = 0;     ///< [kg]
  Vec3d com{0, 0, 0};  ///< centre of mass in the body frame [m]
  Sym3<double> inertia{0, 0, 0, 0,
                       0, 0};  ///< about the centre of mass, along `axes` [kg m²], tensor elements
  Mat3<double> axes = Mat3<double>::identity();  ///< inertia axes in the body frame
};

/// A joint, as given by the user.
struct JointSpec {
  std::string name;            ///< empty: the body's name
  std::string type = "fixed";  ///< one of joint_type_names()
  Vec3d axis{0, 0, 1};  ///< in the joint frame; need not be unit. Ignored by spherical and free
  /// universal: second rotation axis; planar: first translation (its part in the plane)
  std::optional<Vec3d> second_axis;
  double pitch = 0;  ///< helical [m/rad]
  double damping = 0, stiffness = 0, rest = 0,
         friction = 0;  ///< see JointProperties; for one degree of freedom
  std::optional<double> lower, upper, effort, rate;
  /// Rotor (armature) inertia [kg m² | kg], >= 0; joints with one degree of freedom only: n² J for
  /// a rotor of inertia J behind a gear of ratio n, as seen at the joint. It adds ½ n²J q̇² to the
  /// energy, n²J q̇ to the joint's momentum and n²J to its entry of the mass matrix. As usual, the
  /// model neglects the gyroscopic moment of the spinning rotor on the link that carries it: those
  /// terms scale with n J, a factor n smaller. Include the rotor's mass and its J at rest in the
  /// mass properties of that link. Source: Featherstone 2008, section 9.6.
  double rotor_inertia = 0;
  std::string where;  ///< "file:line" for messages; empty: the body's
  /// The body stands for the joint of its parent, whose own parent it carries (reconfiguration.h).
  bool turned = false;
};

/// A body, the joint that carries it, and the placement of that joint.
struct BodySpec {
  std::string name;
  std::string parent;  ///< name of another body, or "world"
  JointSpec joint;
  Pose placement{Mat3<double>::identity(),
                 {0, 0, 0}};  ///< joint frame (= body frame at q = 0) in the parent's body frame
  MassProperties mass;
  std::string where;  ///< "file:line" for messages, may be empty
};

/// A moving part has no mass. Either give one of the links mass properties, or lock the joint.
struct MasslessPart : InvalidArgument {
  MasslessPart(const std::string& text, std::string mover, std::vector<std::string> massless)
      : InvalidArgument(text), joint(std::move(mover)), links(std::move(massless)) {}
  std::string joint;               ///< the joint that moves it
  std::vector<std::string> links;  ///< the links without mass
};

/// An inertia is positive but breaks the triangle inequality. accept_unphysical_inertia takes it.
struct UnphysicalInertia : InvalidArgument {
  using InvalidArgument::InvalidArgument;
};

/// The outermost joint with a degree of freedom that moves no inertia at the configuration q.
/// Returns nothing if every joint moves some inertia there.
std::optional<std::string> joint_without_inertia(const Mechanism& m, std::span<const double> q);

/// Collects bodies in any order, validates them, and makes the immutable Mechanism.
class MechanismBuilder {
 public:
  explicit MechanismBuilder(std::string name = "mechanism") : name_(std::move(name)) {}
  MechanismBuilder& add(BodySpec body);
  /// The bodies added so far; they may be changed before another build().
  std::vector<BodySpec>& bodies() { return bodies_; }
  const std::vector<BodySpec>& bodies() const { return bodies_; }
  MechanismBuilder& gravity(const Vec3d& g);
  /// Accepts inertias that are positive but violate the triangle inequality, as in some published
  /// robots. Each becomes a remark of the mechanism. Off by default.
  MechanismBuilder& accept_unphysical_inertia(bool accept);

  /// @throws InvalidArgument naming the offender (and file:line if known): duplicate or unknown
  ///   names, a cycle, a negative or non-finite mass, an inertia that is not positive or breaks the
  ///   triangle inequality, a zero axis, an unknown joint type, negative damping or stiffness;
  ///   MasslessPart for a joint that moves no inertia at any configuration tried;
  ///   UnphysicalInertia.
  Mechanism build() const;

 private:
  std::string name_;
  std::vector<BodySpec> bodies_;
  Vec3d gravity_{0, 0, 0};
  bool accept_unphysical_ = false;
};

/// The rotation matrix of URDF's roll-pitch-yaw, Rz(yaw) Ry(pitch) Rx(roll), rounded only once.
Mat3<double> rotation_from_rpy(double roll, double pitch, double yaw);

}  // namespace porthos::mechanics
