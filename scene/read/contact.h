#pragma once
#include <optional>
#include <string>
#include <vector>

#include "contact/contact.h"

namespace porthos::scene {

class Table;

/// A [[contact]] of a scene, before the model is known.
struct SceneContact {
  std::string name, where;
  std::vector<std::string> links, against;  ///< against: may be "world"
  std::optional<contact::Shape> shape,
      against_shape;  ///< of every link on a side; empty: its <collision>, of the world z = 0
  contact::Law law;
  double modulus = 0;  ///< [Pa]: Hertz's stiffness follows from the shapes; 0: it is stated
};

/// Reads the [[contact]] tables. @throws InvalidArgument as read_scene()
std::vector<SceneContact> read_contacts(const Table& scene);

/// Reads the keys of a law: law, stiffness, exponent, width, loss or restitution with speed.
/// @throws InvalidArgument as read_scene()
contact::Law read_law(const Table& t);

}  // namespace porthos::scene
