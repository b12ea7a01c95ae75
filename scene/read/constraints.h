#pragma once
#include <map>
#include <string>

#include "mechanics/constraints/constraint_spec.h"

namespace porthos::scene {

class Table;

/// [[loop]] and [[coupling]] of a scene.
struct SceneConstraints {
  mechanics::ConstraintSpec spec;
  std::map<std::string, std::string> where;  ///< "file:line" of each, by name

  bool empty() const { return spec.empty(); }
  /// The same error with the place of the constraint that its text names.
  InvalidArgument placed(const InvalidArgument& error) const;
};

/// @throws InvalidArgument "file:line:column: ..." for a wrong type, key or value
SceneConstraints read_constraints(const Table& scene);

}  // namespace porthos::scene
