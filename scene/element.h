#pragma once
#include <optional>
#include <string>
#include <vector>

#include "phs/network.h"

namespace porthos::mechanics {
class MechanicalModel;
}

namespace porthos::scene {

class Table;
struct Scene;

/// Something that acts at a joint of the model: a [[element]] of the scene, docs/scene.md.
struct Element {
  std::string type, name, joint;
  std::string where;  ///< "file:line:column"

  std::optional<phs::Potential> potential;  ///< of a spring
  phs::FunctionPtr law;                     ///< of a damper or friction
  phs::FunctionPtr source;                  ///< of a torque; the voltage of a motor
  std::optional<phs::DcMotor> motor;
  /// Of a joint controller, tau = stiffness (target - z) + damping (speed - z').
  struct Gains {
    double stiffness, damping, target, speed;
  };
  std::optional<Gains> gains;
  std::optional<double> wheel_gain;    ///< [N m s/rad], of a reaction wheel
  double rate = 0;                     ///< [Hz], of a sampled one; 0: continuous
  bool mean = false;                   ///< it sees the mean rate between its instants
  std::optional<double> lower, upper;  ///< of limits; not given: the model file's
  double stiffness = 0;
};

/// Reads the [[element]] tables. @throws InvalidArgument as read_scene()
std::vector<Element> read_elements(const Table& scene);

/// The model with the elements at its joints; the model itself if there are none.
/// @throws InvalidArgument naming file and line, for an unknown joint, one of several freedoms, or limits without bounds
std::shared_ptr<const phs::Model> with_elements(
    std::shared_ptr<const mechanics::MechanicalModel> model, const std::vector<Element>& elements);

}  // namespace porthos::scene
