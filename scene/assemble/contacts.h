#pragma once
#include <memory>

#include "integrators/core/integrator.h"
#include "mechanics/mechanical_model.h"
#include "scene/read/scene.h"
#include "space/split_integrator.h"

namespace porthos::scene {

/// A mechanism, with its parts in `inner`, with the scene's contacts and joint stops; `inner` if
/// there are none.
/// @throws InvalidArgument naming file and line, as contact::ContactModel, for a link without a
///   shape, for a modulus with shapes that are not spheres and planes, for a stop without limits,
///   and in orbit for what touches the world
std::shared_ptr<const phs::Model> with_contacts(
    std::shared_ptr<const phs::Model> inner,
    const std::shared_ptr<const mechanics::MechanicalModel>& mechanical, const Scene& scene);

/// @throws InvalidArgument naming file and line: two links of a contact that are one rigid body at
///   the start
void check_contacts(const Scene& scene, const mechanics::Mechanism& mechanism);

/// Whether the force of some contact or stop of a scene, or a derivative of it, jumps where it
/// begins to touch.
bool switches(const Scene& scene);

/// A method whose steps end where the contacts of its model begin and cease to touch; the method
/// itself if nothing in the model switches. @param h  the method's step; @param of_run  the same
/// model with what its sampled controllers hold in this run, null: the method's own
std::unique_ptr<integrators::Integrator> ending_at_touches(
    std::unique_ptr<integrators::Integrator> method, const phs::Model& model, double h,
    const phs::Model* of_run = nullptr);

/// A splitting in orbit whose internal motion does the same. The craft must outlive its run.
space::SplitOptions split_options(const space::Spacecraft& craft, const std::string& splitting,
                                  const std::string& method, const integrators::Options& options);

}  // namespace porthos::scene
