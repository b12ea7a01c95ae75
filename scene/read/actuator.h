#pragma once
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "vsa/actuator.h"

namespace porthos::mechanics {
class MechanicalModel;
}

namespace porthos::scene {

class Table;

/// An actuator between a joint and its motors: an [[actuator]] of the scene, docs/actuators.md.
struct JointActuator {
  std::string name, joint;
  std::string where;  ///< "file:line:column"
  vsa::Actuator actuator;
  std::optional<double>
      theta;                ///< start [rad]; none: the joint's angle, where the spring is at rest
  double sigma = 0;         ///< start
  std::string remark = {};  ///< on its table, for the notes of a run; empty: none
};

/// Where an actuator's angles and σ, and the momenta of its rotors, stand in a state; -1: nowhere.
struct ActuatorPlace {
  int link = -1, theta = -1, sigma = -1;
  int momentum_of_theta = -1, momentum_of_sigma = -1;
};
ActuatorPlace place_of(const JointActuator& actuator, const phs::Description& description);

/// Reads the [[actuator]] tables. @throws InvalidArgument as read_scene()
std::vector<JointActuator> read_actuators(const Table& scene);

/// Adds the actuators at the joints of the member "mechanism" of a network.
/// @throws InvalidArgument naming file and line, for an unknown joint or one that an actuator or
/// motor already drives
void add_actuators(phs::Network& n, const mechanics::MechanicalModel& model,
                   const std::vector<JointActuator>& actuators);

/// Start states of the actuators by name, with the mechanism's coordinates at q.
/// @throws InvalidArgument naming file and line, for a deflection or σ beyond its limits
std::vector<std::pair<std::string, std::vector<double>>> start_actuators(
    const mechanics::MechanicalModel& model, const std::vector<JointActuator>& actuators,
    std::span<const double> q);

/// Notes on motors driven by position whose command at t = 0 is more than 0.1 (rad, of σ in its
/// unit) from where they start in the state x.
std::vector<std::string> command_jumps(const std::vector<JointActuator>& actuators,
                                       const phs::Description& description,
                                       std::span<const double> x);

}  // namespace porthos::scene
