#pragma once
#include <string>
#include <vector>

#include "scene/read/element.h"
#include "scene/read/schema.h"

namespace porthos::scene {

/// A type of [[element]]: the keys of its table and their reader.
struct ElementType {
  std::string name, what;
  enum class Place { joint, link } place = Place::joint;
  std::vector<SchemaKey> keys;  ///< besides type, name and joint
  /// Fills the members of this type, including `Element::add` for an element at a joint. type,
  /// name, joint and where are already set.
  void (*read)(const Table&, Element&);

  SchemaTable table() const;
};

/// Every type, in the order of docs/scene_reference.md. A new type is a file in this folder and a
/// line of element_types.cpp.
const std::vector<ElementType>& element_types();

}  // namespace porthos::scene
