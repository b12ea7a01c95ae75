#pragma once
#include <string>
#include <vector>

#include "scene/read/element.h"
#include "scene/read/schema.h"

namespace porthos::scene {

/// A type of [[element]]: what may stand in its table, and how it is read.
struct ElementType {
  std::string name, what;
  enum class Place { joint, link } place = Place::joint;
  std::vector<SchemaKey> keys;  ///< besides type, name and joint
  /// Fills what is of this type, `Element::add` among it for one at a joint. type, name, joint and
  /// where are there already.
  void (*read)(const Table&, Element&);

  SchemaTable table() const;
};

/// Every type, in the order of docs/scene_reference.md; a new one is a file of this folder and a
/// line of element_types.cpp.
const std::vector<ElementType>& element_types();

}  // namespace porthos::scene
