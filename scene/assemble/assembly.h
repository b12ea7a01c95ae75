#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "integrators/core/integrator.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "phs/system/state.h"
#include "scene/assemble/centre_of_mass.h"
#include "scene/read/controller.h"
#include "scene/read/scene.h"
#include "space/spacecraft.h"

/// Makes the model to be run from a scene.
namespace porthos::scene {

/// The integrator of a scene, with the step h instead of the scene's.
/// @throws InvalidArgument as integrators::make_controlled
std::unique_ptr<integrators::Integrator> make_integrator(const Scene& scene,
                                                         const phs::Model& model, double h);

/// Everything a run needs, put together from a scene.
struct Assembly {
  std::shared_ptr<const phs::Model> model;  ///< the model to be run
  /// The mechanism in it, whose state comes first in the model's state; null in a system without
  /// one.
  std::shared_ptr<const mechanics::MechanicalModel> mechanical;
  std::shared_ptr<const mechanics::Mechanism> mechanism;
  mechanics::MechanismBuilder parts;  ///< builder of the mechanism
  /// In maximal coordinates: the same mechanism in reduced ones, in which its start is stated.
  std::shared_ptr<const mechanics::MechanicalModel> reduced;
  std::string why_coordinates;  ///< why auto chose its coordinates; empty: the scene stated them
  std::shared_ptr<const space::Spacecraft> spacecraft;  ///< the model, if it is in orbit
  std::string splitting;  ///< of orbit and internal motion, as in OrbitScene
  phs::State initial;
  /// Centre of mass of the floating bodies, if it is taken out of the equations: then `initial` is
  /// relative to it, and uniform gravity acts on it instead of in the model.
  std::optional<CentreOfMass> centre;
  std::vector<mechanics::UrdfNote> notes;
  std::vector<energy_shaping::Certificate> certificates;  ///< of the scene's controllers, in order
  std::vector<HinderedLaw> hindered;                      ///< of the controllers
  std::vector<std::string> remarks;                       ///< as AddedControllers::remarks
  Joined joined;                                          ///< by the events before a phase
  bool is_phase = false;  ///< between events: parts of the scene may be inactive

  /// The model that methods step: in orbit the internal motion alone.
  const phs::Model& internal() const { return spacecraft ? spacecraft->internal() : *model; }
};

/// A method of the catalogue for the assembly, with steps of one size. In orbit it steps the
/// internal motion of the splitting.
/// @throws InvalidArgument as integrators::make_integrator
std::unique_ptr<integrators::Integrator> make_integrator(const Assembly& assembly,
                                                         const std::string& method, double h,
                                                         const integrators::Options& options = {});

/// Where the joints of [model] lock are, by joint or coordinate, its numbers; none: where the model
/// has them. @throws InvalidArgument as assemble()
std::map<std::string, std::vector<double>> locked_places(const Scene& scene);

/// @throws InvalidArgument naming a joint of [initial] that the model does not have, and for
/// everything the URDF reader refuses.
Assembly assemble(const Scene& scene);

/// The mechanism with the scene's elements, actuators and controllers at its joints; itself if
/// there are none.
/// @param added  of the controllers, if not null
/// @throws InvalidArgument naming file and line, as add_elements(), add_actuators() and
///   add_controllers()
std::shared_ptr<const phs::Model> with_joint_parts(
    std::shared_ptr<const mechanics::MechanicalModel> mechanical, const Scene& scene,
    AddedControllers* added = nullptr);

/// A system of the user's own instead of a model file, from the state x at time 0. run() and the
/// verdict take it with a Scene whose method, step, duration and record_every are set. @throws
/// InvalidArgument if x has the wrong size
Assembly assembly_of(std::shared_ptr<const phs::Model> model, std::span<const double> x);

/// The start of a run: `initial` and `centre` of an assembly.
struct Beginning {
  phs::State state;
  std::optional<CentreOfMass> centre;
  std::string note = {};  ///< how the start was moved onto the loops; empty: it was not
};
/// The start of a scene that differs from the scene of the assembly in its [initial] alone.
/// @throws InvalidArgument as assemble; if loops cannot be closed from there
Beginning start_of(const Scene& scene, const Assembly& assembly);

}  // namespace porthos::scene
