#pragma once
#include <optional>
#include <string>
#include <vector>

#include "phs/network.h"
#include "space/parts.h"

namespace porthos::mechanics {
class MechanicalModel;
}

namespace porthos::scene {

class Table;
struct Scene;

/// Something that acts at a joint of the model, or on a body (part.h): a [[element]] of the scene,
/// docs/scene.md.
struct Element {
  std::string type, name, joint;  ///< joint: empty for a part
  std::string where;              ///< "file:line:column"

  std::optional<phs::Potential> potential;  ///< of a spring
  phs::FunctionPtr law;                     ///< of a damper or friction
  phs::FunctionPtr source;                  ///< of a torque; the voltage of a motor
  std::optional<phs::DcMotor> motor;
  /// Of a joint controller, tau = stiffness (target - z) + damping (speed - z').
  struct Gains {
    double stiffness, damping, target, speed;
  };
  std::optional<Gains> gains;
  std::optional<double> wheel_gain;  ///< [N m s/rad], of a reaction wheel
  /// Of a control-moment gyro at its gimbal: tau = gain (source(t) - gimbal rate).
  struct Gimbal {
    std::string wheel;  ///< joint of the wheel it carries
    double gain;        ///< [N m s/rad]
  };
  std::optional<Gimbal> gimbal;
  std::optional<space::Thruster> thruster;
  std::optional<space::Torquer> torquer;
  std::optional<space::SoftLatch> latch;
  double rate = 0;                     ///< [Hz], of a sampled one; 0: continuous
  bool mean = false;                   ///< it sees the mean rate between its instants
  std::optional<double> lower, upper;  ///< of limits; not given: the model file's
  double stiffness = 0;
};

/// Reads the [[element]] tables. @throws InvalidArgument as read_scene()
std::vector<Element> read_elements(const Table& scene);

/// A signal in time: one of the keys constant, sine = { amplitude, frequency, phase }, profile = {
/// times, values }.
phs::FunctionPtr read_signal(const Table& t, const char* unit);

/// A joint's coordinate and port in the network of a scene, whose mechanism is the member
/// "mechanism".
struct JointPlace {
  std::string coordinate, port;
  int q;  ///< among the mechanism's coordinates
};
/// @throws InvalidArgument beginning with `where` and `who`: the joint is unknown or has several
///   freedoms
JointPlace joint_place(const mechanics::MechanicalModel& model, const std::string& where,
                       const std::string& who, const std::string& joint);

/// Puts the elements at the joints of the member "mechanism" of a network.
/// @throws InvalidArgument naming file and line, for an unknown joint, one of several freedoms, or
///   limits without bounds
void add_elements(phs::Network& n, const mechanics::MechanicalModel& model,
                  const std::vector<Element>& elements);

}  // namespace porthos::scene
