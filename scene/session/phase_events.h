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
/// @param phase  results folder of the phase, whose last state is read
/// @param end  time of its last record [s]
/// @param happened  by the summary; none: there is no summary, the times of the scene count
/// @throws InvalidArgument if the last state cannot be read
void pass_events(mechanics::MovingMechanism& moving, const Scene& scene,
                 const std::filesystem::path& phase, double end,
                 const std::optional<EventTimes>& happened);

}  // namespace porthos::scene
