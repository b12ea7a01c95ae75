#pragma once
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

namespace porthos::scene {

/// A note that names every joint that is faster than the velocity of the model file, which nothing
/// enforces; empty if none is. when: "at the end"
std::vector<std::string> notes_on_speeds(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when);

}  // namespace porthos::scene
