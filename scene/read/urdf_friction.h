#pragma once

namespace porthos::scene {

struct Scene;

/// Adds the <dynamics friction> of the model file as elements <joint>.dry_friction, Coulomb's
/// alone, at joints for which the scene states none.
/// @throws InvalidArgument as mechanics::parse_urdf()
void add_urdf_friction(Scene& scene);

}  // namespace porthos::scene
