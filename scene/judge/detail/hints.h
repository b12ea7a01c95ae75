#pragma once
#include "scene/judge/detail/trajectory.h"
#include "scene/run/measure.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// What the rows of a trajectory are measured with.
struct Measuring {
  const Rows& rows;
  const phs::Description& d;  ///< of the model with the works of the torques
  Meter& meter;
  bool centre_out;
  CentreOfMass::Vec gravity;  ///< [m/s²]
  double mass;                ///< of the whole mechanism [kg]
};

/// Notes the question that explains a file best: are angles or rates in degrees, times in
/// milliseconds, lengths in millimetres or kilometres, quaternions x y z w, two axes of places or
/// the columns of two joints exchanged, is there another gravity? Energy, centre of mass and rates,
/// as far as they are off, would be ten times nearer, with a tenth left at most, and none of them
/// worse. Of momenta in place of rates it tells nothing; of a model with works of its own the
/// energy tells nothing. Joints are exchanged of up to eight; a note says so where they were not.
/// @return whether it asked
bool ask_about_columns(RunReport& r, const Trajectory& trajectory, const Measuring& by);

}  // namespace porthos::scene
