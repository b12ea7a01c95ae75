#pragma once
#include <string>

namespace porthos::apps {

/// The text of `porthos actuators`: the devices of the catalogue as a table.
std::string actuators_text();
/// The catalogue as one JSON object: families and devices (`porthos actuators --json`).
std::string actuators_json();
/// The catalogue as the page docs/actuators.md (`porthos actuators --markdown`).
std::string actuators_markdown();
/// Writes the plot of every device with a model as <folder>/<name>.svg (`--plots`).
/// @throws IoError if the folder cannot be written
void write_actuator_plots(const std::string& folder);

}  // namespace porthos::apps
