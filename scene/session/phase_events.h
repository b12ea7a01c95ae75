#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mechanics/reconfiguration.h"
#include "scene/read/scene.h"

namespace porthos::scene {

/// Events by their texts, with the times when they happened [s].
using EventTimes = std::vector<std::pair<std::string, double>>;

/// Takes the mechanism of a phase over the events at its end, so that it is that of the next phase.
/// @param last  the state at the end, of the mechanism and what follows it
/// @param end  time of that state [s]
/// @param happened  by the summary; none: there is no summary, the times of the scene count
void pass_events(mechanics::MovingMechanism& moving, const Scene& scene, const phs::State& last,
                 double end, const std::optional<EventTimes>& happened);
/// The same. @param phase  results folder of the phase, whose last state is read
/// @throws InvalidArgument if it cannot be read
void pass_events(mechanics::MovingMechanism& moving, const Scene& scene,
                 const std::filesystem::path& phase, double end,
                 const std::optional<EventTimes>& happened);

}  // namespace porthos::scene
