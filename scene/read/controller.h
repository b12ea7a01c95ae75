#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/certificate.h"
#include "energy_shaping/port_law.h"
#include "phs/network/network.h"

namespace porthos::mechanics {
class MechanicalModel;
}

namespace porthos::scene {

class Table;
struct Scene;

/// What a controller is designed for: the mechanism alone, without elements and actuators.
struct ControllerPlant {
  std::shared_ptr<const mechanics::MechanicalModel> model;
  const Scene& scene;
};

/// The law of a controller and the conditions that were checked when it was made.
struct ControllerDesign {
  std::vector<energy_shaping::PortLaw> laws;
  energy_shaping::Certificate certificate;
};

/// A controller of several joints: a [[controller]] of the scene, docs/scene.md. Its types are the
/// files of controllers/.
struct Controller {
  std::string type, name;
  std::string where;  ///< "file:line:column"
  double rate = 0;    ///< [Hz], sampled and held; 0: continuous
  /// Makes the law. @throws InvalidArgument for a condition that fails
  std::function<ControllerDesign(const Controller&, const ControllerPlant&)> design;
};

/// Reads the [[controller]] tables. @throws InvalidArgument as read_scene()
std::vector<Controller> read_controllers(const Table& scene);

/// Puts the controllers at the ports of the member "mechanism" of a network.
/// @return the certificate of each, in order
/// @throws InvalidArgument naming file and line, for a condition that fails
std::vector<energy_shaping::Certificate> add_controllers(
    phs::Network& n, const std::shared_ptr<const mechanics::MechanicalModel>& model,
    const Scene& scene);

}  // namespace porthos::scene
