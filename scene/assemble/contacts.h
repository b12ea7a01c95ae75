#pragma once
#include <functional>
#include <memory>

#include "contact/contact.h"
#include "integrators/core/integrator.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "scene/read/scene.h"
#include "space/split_integrator.h"

namespace porthos::scene {

/// A mechanism, with its parts in `inner`, with the scene's contacts, joint stops and dry friction;
/// `inner` if there are none.
/// @throws InvalidArgument naming file and line, as contact::ContactModel, for a link without a
///   shape, for a modulus with shapes that are not spheres and planes, for a stop without limits,
///   in orbit for what touches the world, and for what is rigid or dry in a mechanism with
///   constraints
std::shared_ptr<const phs::Model> with_contacts(
    std::shared_ptr<const phs::Model> inner,
    const std::shared_ptr<const mechanics::MechanicalModel>& mechanical, const Scene& scene);

/// @throws InvalidArgument naming file and line: two links of a contact that are one rigid body at
///   the start; links that shall touch each other of which no two can
void check_contacts(const Scene& scene, const phs::Model& model);

/// The contacts in a model of a scene, null: none.
const contact::ContactModel* contacts_in(const phs::Model& model);

/// In [[contact]] against: the links among themselves.
inline constexpr const char* each_other = "each other";

/// Whether the force of some contact, stop or dry joint of a scene, or a derivative of it, jumps
/// where it begins to touch, or stops.
bool switches(const Scene& scene);

/// Whether a model of a scene has rigid contacts or stops, or dry friction: only runs have them.
bool jumps(const phs::Model& model);

/// Makes a method for a model.
using MakeMethod = std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>;

/// A method for a model whose steps end where its contacts begin and cease to touch and where its
/// dry joints stop and break away, and jump where rigid contacts do; the method itself if nothing
/// in the model switches. A method that makes the jumps itself has the rigid contacts of the model.
/// @param method  its name; h: its step; options: of one that makes the jumps itself
/// @param make  makes the method for the model it is given
std::unique_ptr<integrators::Integrator> with_touches(const phs::Model& model,
                                                      const std::string& method, double h,
                                                      const integrators::Options& options,
                                                      const MakeMethod& make);

/// @throws InvalidArgument naming file and line: a rigid contact or stop whose shapes overlap at
/// the
///   start, by more than 1e-9 m (or rad)
void check_overlaps(const Scene& scene, const phs::Model& model, const phs::State& start);

/// Of each soft contact that is deeper at the start than 1/10 of half the least extent of its
/// smaller shape (the radius of a ball): how deep, and what it stores.
std::vector<mechanics::UrdfNote> notes_on_depths(const Scene& scene, const phs::Model& model,
                                                 const phs::State& start);

/// A splitting in orbit whose internal motion does the same. The craft must outlive its run.
space::SplitOptions split_options(const space::Spacecraft& craft, const std::string& splitting,
                                  const std::string& method, const integrators::Options& options);

}  // namespace porthos::scene
