#pragma once
#include <array>
#include <string>
#include <vector>

#include "scene/read/controller.h"
#include "scene/read/schema.h"

namespace porthos::scene {

/// A type of [[controller]]: the keys of its table, the tables in it, and their reader.
struct ControllerType {
  std::string name, what;
  /// Besides type, name, rate, and those of sensing_keys() and tank_keys().
  std::vector<SchemaKey> keys;
  std::vector<SchemaTable> tables;  ///< inside it
  /// Sets `design`; the other members are set.
  void (*read)(const Table&, Controller&);
  bool always_sampled = false;  ///< a rate must be stated
  std::string file_key = {};    ///< the key that names the file of the law

  SchemaTable table() const;
};

/// Every type, in the order of docs/scene_reference.md. A new type is a file in this folder and a
/// line of controller_types.cpp.
const std::vector<ControllerType>& controller_types();

// What the types share.

/// A joint of one degree of freedom: its coordinate and its port.
struct ControlledJoint {
  size_t q;
  std::string port;
};
/// @throws InvalidArgument beginning with the controller's place, listing the known ones
ControlledJoint controlled_joint(const mechanics::MechanicalModel& model, const Controller& c,
                                 const std::string& joint);
/// A quaternion, normalised; [1, 0, 0, 0] if the key is missing.
std::array<double, 4> read_attitude(const Table& t, const char* key);
/// Start values of all coordinates as [initial] states them; random ones count as 0.
std::vector<double> stated_start(const ControllerPlant& plant);

/// The joints of a table by name: read(its table, joint) fills what is not the name.
template <class Joint>
std::vector<Joint> read_joints(const auto& table, const auto& read) {
  std::vector<Joint> all;
  table.each("joints", [&](const std::string& name, const std::string&, const auto& own) {
    all.emplace_back().joint = name;
    read(own, all.back());
  });
  return all;
}
/// Controller::design of what was read.
template <class Read>
auto made_of(ControllerDesign (*design)(const Controller&, const ControllerPlant&, const Read&),
             Read read) {
  return [design, read = std::move(read)](const Controller& own, const ControllerPlant& plant) {
    return design(own, plant, read);
  };
}

}  // namespace porthos::scene
