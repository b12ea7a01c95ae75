#pragma once
#include <map>
#include <string>
#include <vector>

#include "mechanics/builder.h"

namespace porthos::mechanics {

/// How to read a URDF file.
struct UrdfOptions {
  enum class Base { fixed, free } base = Base::fixed;  ///< how the root link is carried
  Vec3d gravity{0, 0, 0};
  /// What a link without <inertial> is that moves and has no fixed joint to a link with one: an
  /// error (the default), or a massless frame by the user's explicit choice. On a fixed joint it is
  /// a frame, which is noted.
  enum class NoInertia { error, massless } links_without_inertia = NoInertia::error;
  /// Mass properties for links the file gives none or no mass, by link name; naming a link that has
  /// mass is an error.
  std::map<std::string, MassProperties> link_inertia;
  /// Rotor (armature) inertia [kg m² | kg] by joint name, see JointSpec: URDF has no key for it. A
  /// name the file does not have is an error.
  std::map<std::string, double> rotor_inertia;
  /// Joints held where they start, as if they were fixed; a name the file does not have is an
  /// error.
  std::vector<std::string> locked;
  /// Where: coordinates of locked joints, by the names of their blocks ("j", "j.angle",
  /// "j.position"), of an attitude by that of the joint too; absent: neutral.
  std::map<std::string, std::vector<double>> locked_at;
  bool accept_unphysical_inertia = false;  ///< see MechanismBuilder::accept_unphysical_inertia
  bool use_damping =
      true;  ///< <dynamics damping> becomes viscous joint damping; false: reported only
};

/// Something read but not simulated, or worth knowing.
using UrdfNote = Remark;

/// A URDF file as a mechanism, and what of it was not taken as it stands.
struct UrdfResult {
  Mechanism mechanism;
  std::vector<UrdfNote>
      notes;  ///< unknown tags and attributes, mimic, limits, friction, ignored geometry counts
  std::string root_link;
  MechanismBuilder parts;  ///< what the mechanism was built from, for reconfiguration.h
};

/// Name of the free joint a free base gets, and of its coordinate blocks "base.position" and
/// "base.attitude".
inline constexpr const char* base_joint_name = "base";

/// Reads a mechanism from a URDF file. Visual and collision geometry is not needed and not read.
/// Taken with a note: a lower limit above the upper one (no limit), a parent "world" that is not
/// declared (the inertial frame), a robot without a name (the file's), <mimic> (ignored), tags and
/// attributes that are not known.
/// @throws InvalidArgument "file:line: ..." for a missing file, broken XML, missing or malformed
///   numbers, unknown joint types, several root links, cycles, and everything MechanismBuilder
///   refuses; MasslessPart for links without <inertial> that move
UrdfResult read_urdf(const std::string& path, const UrdfOptions& options = {});

/// The same from text; `name` stands for the file in messages.
UrdfResult parse_urdf(const std::string& text, const std::string& name,
                      const UrdfOptions& options = {});

}  // namespace porthos::mechanics
