#include "scene/read/urdf_friction.h"

#include <algorithm>

#include "scene/read/scene.h"

namespace porthos::scene {

void add_urdf_friction(Scene& s) {
  const auto model = mechanics::parse_urdf(s.urdf_text, s.urdf_path, s.urdf);
  const auto given = [&](const std::string& joint) {
    return std::ranges::any_of(s.elements,
                               [&](const Element& e) { return e.dry && e.joint == joint; });
  };
  for (const auto& j : model.mechanism.joint_properties())
    if (j.friction > 0 && !given(j.joint)) {
      Element e;
      e.type = "dry_friction";
      e.name = j.joint + ".dry_friction";
      e.joint = j.joint;
      e.where = s.urdf_path;
      e.dry = {.name = e.name, .joint = e.joint, .coulomb = j.friction};
      s.elements.push_back(std::move(e));
    }
}

}  // namespace porthos::scene
