#pragma once
#include "scene/judge/detail/trajectory.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Notes the angles that are known modulo a turn only, and sets aside what fails and depends on
/// them: the energy with a spring at such a joint, couplings, the momenta with a helical joint.
/// @param last  the state of the last row
void judge_turns(RunReport& r, const Trajectory& trajectory, const Rows& rows,
                 const phs::Model& model, const phs::State& last);

/// Checks of these names that fail are told to be undecided. @return whether there were any
bool set_aside(RunReport& r, const std::vector<std::string>& names, const std::string& why);

}  // namespace porthos::scene
