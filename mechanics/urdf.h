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
  /// What a link without <inertial> is: an error (the default), or a massless frame by the user's explicit choice.
  enum class NoInertia { error, massless } links_without_inertia = NoInertia::error;
  /// Mass properties for links the file gives none, by link name; naming a link that has an <inertial> is an error.
  std::map<std::string, MassProperties> link_inertia;
  /// Rotor (armature) inertia [kg m² | kg] by joint name, see JointSpec: URDF has no key for it. A name the file does not
  /// have is an error.
  std::map<std::string, double> rotor_inertia;
  bool accept_unphysical_inertia = false;  ///< see MechanismBuilder::accept_unphysical_inertia
  bool use_damping =
      true;  ///< <dynamics damping> becomes viscous joint damping; false: reported only
};

/// Something read but not simulated, or worth knowing.
using UrdfNote = Remark;

struct UrdfResult {
  Mechanism mechanism;
  std::vector<UrdfNote>
      notes;  ///< unknown tags and attributes, mimic, limits, friction, ignored geometry counts
  std::string root_link;
  MechanismBuilder parts;  ///< what the mechanism was built from, for reconfiguration.h
};

/// Name of the free joint a free base gets, and of its coordinate blocks "base.position" and "base.attitude".
inline constexpr const char* base_joint_name = "base";

/// Reads a mechanism from a URDF file. Visual and collision geometry is not needed and not read.
/// @throws InvalidArgument "file:line: ..." for a missing file, broken XML, missing or malformed numbers, unknown
///   joint types, several root links, cycles, and everything MechanismBuilder refuses
UrdfResult read_urdf(const std::string& path, const UrdfOptions& options = {});

/// The same from text; `name` stands for the file in messages.
UrdfResult parse_urdf(const std::string& text, const std::string& name,
                      const UrdfOptions& options = {});

}  // namespace porthos::mechanics
