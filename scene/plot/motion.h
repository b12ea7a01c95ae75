#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "mechanics/mechanism.h"
#include "scene/plot/trace_plot.h"
#include "vsa/actuator.h"

namespace porthos::scene {

struct Scene;

/// The spring of an actuator. Its state is in the series "state/<name>.link", ".theta", ".sigma".
struct Spring {
  std::string name;
  vsa::ElasticPtr energy;
  vsa::Drive motor = {}, winder = {};  ///< of its equilibrium and of its stiffness
  /// No controller of the scene may add to the torque of the motor or the winder.
  bool alone = true, winder_alone = true;
};
/// Those of a scene's actuators.
std::vector<Spring> springs_of(const Scene& scene);

/// What the phases of a run share, of each of which the motion is shown apart.
struct WholeRun {
  /// The first record of a series in the first phase, from which rotations and paths count; empty:
  /// they count from the own first record.
  std::function<std::vector<double>(const std::string& name)> first = {};
  std::vector<std::string> turning = {};  ///< turning_joints() of all phases
};

/// The records of a run from which its motion is shown.
struct MotionRecords {
  std::vector<double> t;           ///< [s]
  std::vector<std::string> turns;  ///< the names behind the columns of "turns"
  /// The columns of a series of run.h5 ("state/elbow") at these times, one record after another;
  /// empty: there is no such series.
  std::function<std::vector<double>(const std::string& name)> rows;
  /// Name and unit of the outputs of the scene, the series "output/<name>".
  std::vector<std::pair<std::string, std::string>> outputs = {};
  std::vector<Spring> springs = {};
  WholeRun whole = {};
};

/// The joints that make more than four turns from zero, from their states and "turns".
std::vector<std::string> turning_joints(const MotionRecords& records);

/// How a mechanism moved: the scene's outputs (numbers of one unit share a panel), positions and
/// rates of its joints, and of every body that is free or on a ball joint its attitude (rotation
/// from the start as a vector along its axis, continuous where less than half a turn lies between
/// two records), its angular rate in its own axes, its path from the start and its velocity, both
/// in world axes. Rates are of the recorded momenta, v = M(q)⁻¹ p. Of an actuator its spring, and
/// angle, torque (vsa::drive_torque, or what the drive holds) and power of a motor that moves.
/// A joint that makes more than four turns, in whatever phase, has panels apart. Empty: a
/// coordinate is not recorded.
std::vector<TracePanel> motion_panels(const mechanics::Mechanism& mechanism,
                                      const MotionRecords& records);

}  // namespace porthos::scene
