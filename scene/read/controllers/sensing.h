#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/port_law.h"
#include "phs/functions/law.h"
#include "scene/read/schema.h"

namespace porthos::mechanics {
class MechanicalModel;
}

namespace porthos::scene {

class Table;

/// What lies between the motion and a sampled controller, and between the controller and the
/// joints. All 0: nothing.
struct Sensing {
  int delay = 0;  ///< [periods] from a measurement to the torque made from it
  /// Measured values and torques are the nearest multiples of it [rad | m, rad/s | m/s, N m | N].
  double position_resolution = 0, rate_resolution = 0, torque_resolution = 0;
  double position_noise = 0, rate_noise = 0;  ///< standard deviations, before the resolution
  /// Of the base and of ball joints: about each axis of the body [rad, rad/s].
  double attitude_noise = 0, angular_velocity_noise = 0;
  std::uint64_t seed = 1;  ///< of the noise

  bool measures_attitude() const { return attitude_noise > 0 || angular_velocity_noise > 0; }
  bool measures() const {
    return position_resolution > 0 || rate_resolution > 0 || position_noise > 0 || rate_noise > 0 ||
           measures_attitude();
  }
  bool any() const { return delay > 0 || torque_resolution > 0 || measures(); }
};
/// The keys delay, resolution and noise, and the tables in them.
std::vector<SchemaKey> sensing_keys();
std::vector<SchemaTable> sensing_tables();
Sensing read_sensing(const Table& t);

/// A joint of one degree of freedom that is measured, or the attitude of the base or a ball joint.
struct MeasuredJoint {
  std::string name;
  size_t q;  ///< of its coordinate in the state
  size_t v;  ///< of its rate in the outputs of the law's ports, or in the rates of the mechanism
  bool attitude = false;  ///< a quaternion, and an angular velocity in its own axes
};

/// Where the noise of a controller comes from: the same numbers for the same names, seed, case and
/// instant, in any thread and after a checkpoint.
struct NoiseKey {
  std::string controller;
  std::uint64_t of_case = 0;  ///< of an ensemble, from 1; 0: a run by itself
};

/// A law behind sensors, at ports with so many numbers. Angles of several turns are measured with
/// their turns.
/// @param of_state  a law that looks at x = (q, p) alone: it gets the momenta of the measured
///   rates, and `joints` counts the rates of the mechanism. Otherwise it gets x, behind it the
///   measured positions in the order of `joints`, and the measured rates as outputs of its ports.
phs::SampledLawPtr sensed(phs::SampledLawPtr law, const Sensing& how, double period, size_t ports,
                          std::vector<MeasuredJoint> joints, NoiseKey key,
                          std::shared_ptr<const mechanics::MechanicalModel> model, bool of_state);

/// Laws of ports of a mechanism as one law without a memory, which looks at x = (q, p) alone.
phs::SampledLawPtr sampled_port_laws(std::vector<energy_shaping::PortLaw> laws,
                                     std::shared_ptr<const mechanics::MechanicalModel> model);

}  // namespace porthos::scene
