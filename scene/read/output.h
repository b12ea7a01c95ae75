#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"
#include "scene/read/schema.h"

namespace porthos::scene {

class Table;

/// A point on a link.
struct LinkPoint {
  std::string link = "world";
  mechanics::Vec3d at{0, 0, 0};  ///< in the link's frame [m]
  double radius = 0;             ///< of a sphere round it [m]
};

/// Something that is computed from the states of a run and recorded: an [[output]] of the scene,
/// docs/scene.md#output.
struct Output {
  enum class Quantity {
    position,
    attitude,
    euler_angles,
    angle,
    velocity,
    angular_velocity,
    distance,
    joint_position,
    joint_rate,
    joint_torque,
    joint_wrench,
    centre_of_mass,
    momentum,
    angular_momentum,
    energy,
    power,
    deflection,
    stiffness_setting,
    stiffness,
    spring_torque,
    motor_rate,
    motor_torque,
    contact_force,
    normal_force,
    overlap,
    altitude,
    semi_major_axis,
    eccentricity,
    inclination,
    node,
    task_error,
    planned_force,
    planned_footstep,
    capture_point,
    formula
  } quantity;
  bool own_axes = false;  ///< a velocity: along the axes of the link, not those of seen_from
  std::string name;
  LinkPoint of, seen_from;  ///< of quantities of links
  /// The joint, actuator, contact, row of the ledger.
  std::string of_what;
  std::vector<std::string> links = {};  ///< of momenta; empty: all bodies
  bool about_all = false;  ///< an angular momentum: about the centre of mass of all bodies
  /// Of a controller: what it tells, as phs::Shown names it; of a motor: "theta" or "sigma".
  std::string number;
  std::string formula;
  std::string sequence;  ///< of Euler angles
  std::string unit;      ///< empty: that of the joint or of the stiffness setting
  std::string where;     ///< "file:line:column"
  size_t size() const;
  bool of_joint() const {
    return quantity >= Quantity::joint_position && quantity <= Quantity::joint_wrench;
  }
  bool of_actuator() const {
    return quantity >= Quantity::deflection && quantity <= Quantity::motor_torque;
  }
  bool of_motor() const {
    return quantity == Quantity::motor_rate || quantity == Quantity::motor_torque;
  }
  bool of_orbit() const { return quantity >= Quantity::altitude && quantity <= Quantity::node; }
  bool of_contact() const {
    return quantity >= Quantity::contact_force && quantity <= Quantity::overlap;
  }
  bool of_controller() const {
    return quantity >= Quantity::task_error && quantity <= Quantity::capture_point;
  }
  /// Whether it depends on what sampled controllers hold.
  bool needs_field() const;
};

using OutputQuantity = Output::Quantity;

/// What the names of n numbers that belong together end with: "x", "y", "z"; nothing of one.
std::vector<std::string> component_suffixes(size_t n);
/// The names of an output's numbers: its own, or "tip.x", "tip.y", "tip.z".
std::vector<std::string> component_names(const Output& o);
/// Those of all.
std::vector<std::string> number_names(const std::vector<Output>& outputs);
/// The outputs on which a number depends, in their order: its own, and those that a formula uses.
std::vector<Output> needed_for(const std::string& number, const std::vector<Output>& outputs);

/// Ends a run where an output passes a value, or judges it by that: a [[stop]] of the scene.
struct Stop {
  std::string name, output;  ///< output: a component name
  bool above = true;
  double limit = 0;
  double after = 0;    ///< [s]
  bool fails = false;  ///< the run then fails
  bool ends = true;    ///< false: the run goes on, and its verdict fails
  bool is_requirement() const { return fails || !ends; }  ///< has a row among the checks
  std::string where;                                      ///< "file:line:column"
};
/// "altitude below 120000", for reports.
std::string text(const Stop& s);

/// @throws InvalidArgument with the place and the name of the output
[[noreturn]] void refuse_output(const Output& o, const std::string& why);

/// The tables [[output]]. @throws InvalidArgument as read_scene()
std::vector<Output> read_outputs(const Table& scene);
/// The tables [[stop]]. @throws InvalidArgument as read_scene()
std::vector<Stop> read_stops(const Table& scene, const std::vector<Output>& outputs);

/// The table [[stop]] of the schema.
SchemaTable stop_table();
/// The tables of the schema, one for each quantity, and that of [[stop]].
std::vector<SchemaTable> output_tables();

}  // namespace porthos::scene
