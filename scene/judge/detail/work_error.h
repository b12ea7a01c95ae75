#pragma once
#include "scene/judge/detail/trajectory.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// A judged trajectory, by row.
struct JudgedRows {
  const Rows& at;
  const Numbers& own;     ///< power of the model's own dampers and sources [W]
  const Numbers& errors;  ///< of the energy [J]
};

/// Tells how well rows so far apart tell the works of torques, dampers and sources: by Richardson,
/// from every second row against all. What three times that explains is no drift and no failure. A
/// held torque is exact if it is true: tells whether another torque_between fits ten times better.
void judge_works(RunReport& r, const Trajectory& trajectory, TrajectoryMap::TorqueBetween between,
                 const JudgedRows& rows);

}  // namespace porthos::scene
