#pragma once
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

namespace porthos::scene {

/// One note that names every joint whose coordinate is beyond a position limit of the model file
/// that nothing enforces; empty if none is. when: "at the start"; held: joints whose limits act as
/// elements, which are left out.
std::vector<std::string> notes_on_limits(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when,
                                         const std::vector<std::string>& held);

/// The same for rates above the velocity of the model file, which nothing enforces.
std::vector<std::string> notes_on_speeds(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when);

}  // namespace porthos::scene
