#pragma once
#include <string>
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {
class MechanicalModel;
}

/// Where at a joint something acts or is measured, by the names of a scene.
namespace porthos::scene {

/// A degree of freedom by its name. A coordinate of one number has the coordinate's name. Those of
/// ball and free joints are rates about and along the axes of the child: "wrist.about_x",
/// "tether.along_z".
struct JointFreedom {
  std::string name;
  const mechanics::JointCoordinates* of;  ///< the coordinate it belongs to
  int v;                                  ///< offset in v and τ
  bool has_coordinate() const { return of->nq == 1; }
};
/// In the order of v, but for free joints: position before attitude.
std::vector<JointFreedom> freedoms_of(const mechanics::Mechanism& m);

/// A joint's coordinate and port in the network of a scene, whose mechanism is the member
/// "mechanism".
struct JointPlace {
  std::string coordinate;   ///< empty: a rate that is not the rate of one number
  std::string port;         ///< one component of it where size is 1
  int q = -1;               ///< among the mechanism's coordinates
  int first = 0, size = 1;  ///< freedoms, as components of the whole port
  int port_size = 1;        ///< of the whole port
};

/// A joint's coordinate of one number.
/// @throws InvalidArgument beginning with `where` and `who`: the joint is unknown or has several
/// degrees of freedom
JointPlace joint_place(const mechanics::MechanicalModel& model, const std::string& where,
                       const std::string& who, const std::string& joint);
/// A coordinate of one number or of several, or a freedom.
/// @throws InvalidArgument the same: the name is unknown, or that of a joint with several
/// coordinates, or the joint floats free in space
JointPlace element_place(const mechanics::MechanicalModel& model, const std::string& where,
                         const std::string& who, const std::string& joint);
/// Whether the mechanism has a coordinate or freedom of that name.
bool has_place(const mechanics::Mechanism& m, const std::string& joint);

}  // namespace porthos::scene
