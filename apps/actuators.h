#pragma once
#include <string>

#include "scene/read/scene.h"

namespace porthos::apps {

/// The text of `porthos actuators`: the devices of the catalogue as a table.
std::string actuators_text();
/// The catalogue as one JSON object: families and devices (`porthos actuators --json`).
std::string actuators_json();
/// The catalogue as the page docs/actuators.md (`porthos actuators --markdown`).
std::string actuators_markdown();
/// Writes the plot of the spring of every actuator of a scene as <folder>/<name>.svg.
/// @throws InvalidArgument if there is none, IoError if the folder cannot be written
void write_spring_plots(const scene::Scene& scene, const std::string& folder);
/// Writes the plot of every device with a model as <folder>/<name>.svg (`--plots`).
/// @throws IoError if the folder cannot be written
void write_actuator_plots(const std::string& folder);

}  // namespace porthos::apps
