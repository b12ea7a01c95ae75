#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/foreign_law.h"
#include "mechanics/mechanical_model.h"
#include "scene/read/scene.h"

namespace porthos::scene {

/// Outputs of a scene as inputs of a control law, at states of its mechanism: joints, attitudes,
/// angular velocities, distances, positions and velocities relative to another link, and formulas
/// of these. On a fixed base alone also positions and velocities in the world; where bodies float,
/// the centre of mass may be outside the state.
/// @throws InvalidArgument for a name that is none, or another quantity
energy_shaping::LawInputs law_inputs(const Scene& scene,
                                     const std::shared_ptr<const mechanics::MechanicalModel>& model,
                                     const std::vector<std::string>& names);

}  // namespace porthos::scene
