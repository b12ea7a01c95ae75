#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "mechanics/builder.h"
#include "mechanics/constraints/constraint_spec.h"

namespace porthos::mechanics {

/// Options for reading a URDF file.
struct UrdfOptions {
  enum class Base { fixed, free } base = Base::fixed;  ///< how the root link is mounted
  Vec3d gravity{0, 0, 0};
  /// Treatment of a moving link without <inertial> that no fixed joint ties to a link with one: an
  /// error (the default), or a massless frame by the user's explicit choice. With such a fixed
  /// joint it is a frame, and a note says so.
  enum class NoInertia { error, massless } links_without_inertia = NoInertia::error;
  /// Mass properties by link name, for links without mass in the file. Naming a link that has mass
  /// is an error, unless replaced_inertia has it.
  std::map<std::string, MassProperties> link_inertia;
  /// Links of link_inertia that may have mass in the file: it is replaced.
  std::set<std::string> replaced_inertia;
  /// Rotor (armature) inertia [kg m² | kg] by joint name, see JointSpec; URDF has no key for it. A
  /// name that is not in the file is an error.
  std::map<std::string, double> rotor_inertia;
  /// Joints to hold at their start position as if they were fixed. A name that is not in the file
  /// is an error.
  std::vector<std::string> locked;
  /// Coordinates of locked joints, by the names of their blocks ("j", "j.angle", "j.position"); an
  /// attitude also by the joint's name. Absent: neutral.
  std::map<std::string, std::vector<double>> locked_at;
  bool accept_unphysical_inertia = false;  ///< see MechanismBuilder::accept_unphysical_inertia
  bool couple_mimics = false;  ///< <mimic> becomes a coupling (UrdfResult::mimics); else a note
  bool use_damping =
      true;  ///< <dynamics damping> becomes viscous joint damping; false: reported only
  bool use_friction = false;  ///< the caller simulates <dynamics friction>; false: reported only
};

/// A part of the file that is not simulated, or a remark.
using UrdfNote = Remark;

/// A URDF file as a mechanism, with notes on what was not taken over unchanged.
struct UrdfResult {
  Mechanism mechanism;
  std::vector<UrdfNote>
      notes;  ///< unknown tags and attributes, mimic, limits, friction, counts of ignored geometry
  std::string root_link;
  MechanismBuilder parts;  ///< what the mechanism was built from, for reconfiguration.h
  /// Of <mimic joint multiplier offset>, if they are wanted: q - multiplier q_joint = offset, with
  /// the name "<its joint>.mimic".
  std::vector<Coupling> mimics = {};
};

/// Name of the free joint of a free base; its coordinate blocks are "base.position" and
/// "base.attitude".
inline constexpr const char* base_joint_name = "base";

/// Reads a mechanism from a URDF file. Visual and collision geometry is not needed and not read.
/// These are accepted with a note: a lower limit above the upper one (no limit), an undeclared
/// parent "world" (the inertial frame), a robot without a name (the file's name), <mimic>
/// (ignored unless wanted), unknown tags and attributes. Beside the tree of the root, which `base`
/// is about, other trees may hang on a link "world", the inertial frame.
/// @throws InvalidArgument "file:line: ..." for a missing file, broken XML, missing or malformed
///   numbers, unknown joint types, several root links, cycles, and everything MechanismBuilder
///   refuses; MasslessPart for links without <inertial> that move
UrdfResult read_urdf(const std::string& path, const UrdfOptions& options = {});

/// Another robot beside that of a file.
struct OtherRobot {
  std::string name;  ///< its links and joints are called "<name>.<their names>"
  bool free = true;  ///< floats on a joint called `name`; false: fixed to the world at the place
  Vec3d at{0, 0, 0}, rpy{0, 0, 0};  ///< of its root, fixed; [m], roll, pitch, yaw [rad]
};
/// The text of a file with the links and joints of another file behind its own, as a second tree
/// that hangs on the world. Lines of the first keep their numbers.
/// A first text that is no robot comes back as it is.
/// @throws InvalidArgument with the name of the other file, if its XML is broken
std::string with_robot(const std::string& urdf, const std::string& other,
                       const std::string& other_file, const OtherRobot& robot);

/// The same from text; `name` replaces the file name in messages.
UrdfResult parse_urdf(const std::string& text, const std::string& name,
                      const UrdfOptions& options = {});

}  // namespace porthos::mechanics
