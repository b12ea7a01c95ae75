#pragma once
#include <map>
#include <string>
#include <vector>

#include "mechanics/constraints/constraint_spec.h"
#include "scene/read/event.h"

namespace porthos::scene {

class Table;

/// [[loop]], [[coupling]], [[rolling]] and [[motion]] of a scene.
struct SceneConstraints {
  mechanics::ConstraintSpec spec;
  mechanics::ConstraintSpec later;           ///< open until an [[event]] closes them
  std::map<std::string, std::string> where;  ///< "file:line" of each, by name

  bool empty() const { return spec.empty() && later.empty(); }
  /// The name of one that holds a link to the world, now or later; empty if there is none.
  std::string held_to_the_world() const;
  bool on_the_world() const { return !held_to_the_world().empty(); }
  /// The constraint of this name alone, of those that events close; empty if there is none.
  mechanics::ConstraintSpec awaited(const std::string& name) const;
  /// The same error with the place of the constraint that its text names.
  InvalidArgument placed(const InvalidArgument& error) const;
};

/// events: those that any of them closes are open from the start.
/// @throws InvalidArgument "file:line:column: ..." for a wrong type, key or value, and for an event
/// about a loop that does not exist
SceneConstraints read_constraints(const Table& scene, const std::vector<Event>& events);

}  // namespace porthos::scene
