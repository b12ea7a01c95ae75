#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "energy_shaping/foreign_law.h"
#include "energy_shaping/laws/handover.h"
#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
#include "phs/network/network.h"
#include "scene/read/controllers/sensing.h"
#include "scene/read/controllers/tank.h"

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
  /// The [[output]]s of these names as inputs of a law. @throws InvalidArgument if that cannot be
  std::function<energy_shaping::LawInputs(const std::vector<std::string>& names)> inputs;
  /// Where the state of an actuator begins in that of the network.
  std::function<size_t(const std::string& name)> offset;
};

/// The law of a controller and the conditions that were checked when it was made.
struct ControllerDesign {
  std::vector<energy_shaping::PortLaw> laws;  ///< at ports of the mechanism
  energy_shaping::Certificate certificate;
  /// Where the law holds, if it can take over from another.
  std::optional<energy_shaping::LevelSet> holds = {};
  energy_shaping::Progress progress = {};  ///< of one that hands over
  struct MemberLaw {
    std::string member;  ///< of the network, an actuator; the law sees its state
    energy_shaping::PortLaw law;
  };
  std::vector<MemberLaw> elsewhere = {};
  bool whole = false;  ///< laws elsewhere see the state of the whole network
  /// Instead of laws: one with a memory over several ports, always sampled.
  phs::SampledLawPtr sampled = nullptr;
  std::vector<std::string> ports = {};  ///< of `sampled`, one number each
  std::vector<MeasuredJoint> joints = {};
  /// Of a law that needs a tank for a part of it alone.
  struct Paid {
    std::vector<energy_shaping::PortLaw> laws;  ///< for which the tank pays
    std::vector<std::string> damped;            ///< ports, of one number each, with a damper
    std::vector<double> damping;                ///< d of each
    double fill = 0;                            ///< share of their power that fills the tank
  };
  std::optional<Paid> paid = {};
  std::string remark = {};  ///< what is odd about it, a sentence; empty: nothing
};

/// A file that a controller consists of.
struct LawFile {
  std::string name;        ///< as the scene states it; empty: none
  std::string path, text;  ///< resolved, and what it holds
  bool loaded = true;      ///< false: named by results that are read again, which run no code
};

/// The controller that takes over from another one, where it holds.
struct Takeover {
  std::string by;
  std::optional<double> level = {};  ///< of the other's V; empty: the largest that is known to hold
  double leave = 4;                  ///< the other gives back above leave · level
};

/// A controller of several joints: a [[controller]] of the scene, docs/scene.md. Its types are the
/// files of controllers/.
struct Controller {
  std::string type, name;
  std::string where;     ///< "file:line:column"
  double rate = 0;       ///< [Hz], sampled and held; 0: continuous
  Sensing sensing = {};  ///< of a sampled one
  std::optional<EnergyTank> tank = {};
  LawFile file = {};
  std::optional<Takeover> then = {};
  std::vector<std::string> wheels = {};  ///< joints of reaction wheels that it turns
  std::string cut_target = {};           ///< added to a refusal of its design: an odd target
  /// Makes the law. @throws InvalidArgument for a condition that fails
  std::function<ControllerDesign(const Controller&, const ControllerPlant&)> design;

  /// Its tank's name as a member of the network; empty: it has none.
  std::string tank_name() const { return tank ? name + ".tank" : ""; }
};

/// Reads the [[controller]] tables. folder: that of the scene file, for the files of laws.
/// @throws InvalidArgument as read_scene()
std::vector<Controller> read_controllers(const Table& scene, const std::string& folder);

/// A law of a port that may be hindered: by its limit, or where it is not defined.
struct HinderedLaw {
  std::string controller;
  energy_shaping::PortLaw law;  ///< of the mechanism's state
};

/// What is known of the controllers of a scene.
struct AddedControllers {
  std::vector<energy_shaping::Certificate> certificates;  ///< of each, in order
  /// But for those that hand over or take over, which are made to be at their limits.
  std::vector<HinderedLaw> hindered;
  /// What is odd about them, "file:line:column: ...": limited laws that act at one port together,
  /// without `then`; ControllerDesign::remark.
  std::vector<std::string> remarks;
};

/// Puts the controllers at the ports of the member "mechanism" of a network.
/// @param inputs  ControllerPlant::inputs
/// @throws InvalidArgument naming file and line, for a condition that fails
AddedControllers add_controllers(
    phs::Network& n, const std::shared_ptr<const mechanics::MechanicalModel>& model,
    const Scene& scene,
    const std::function<energy_shaping::LawInputs(const std::vector<std::string>& names)>& inputs);

/// From now on laws in Python run by these functions. Until then the library porthos_python_law is
/// opened for the first of them, from beside the program or from ../lib/porthos.
void use_python_laws(const porthos_law& functions);

}  // namespace porthos::scene
