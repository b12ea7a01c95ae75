#pragma once
#include "scene/judge/detail/trajectory.h"
#include "scene/run/measure.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Notes if the energy is kept ten times better with angles and rates in degrees, or with columns
/// of two joints exchanged. For models without works of their own; of momenta in place of rates it
/// tells nothing.
/// @param d  of the model with the works of the torques
void ask_about_columns(RunReport& r, const Trajectory& trajectory, const Rows& rows,
                       const phs::Description& d, Meter& meter, bool centre_out);

}  // namespace porthos::scene
