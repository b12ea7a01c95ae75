#pragma once
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

namespace porthos::scene {

inline constexpr std::size_t most_told = 3;  ///< joints that a note on limits names

/// A note on joints that are faster than the velocity of the model file, which nothing enforces:
/// the three worst, and how many more there are; empty if none is. when: "at the end"
std::vector<std::string> notes_on_speeds(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when);

}  // namespace porthos::scene
