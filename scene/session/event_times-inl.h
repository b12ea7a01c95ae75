#pragma once
#include <nlohmann/json.hpp>

#include "scene/session/phase_events.h"

namespace porthos::scene {

/// The events of a summary.json; none: it does not list events.
/// @throws nlohmann::json::exception if the list is damaged
inline std::optional<EventTimes> event_times(const nlohmann::ordered_json& summary) {
  if (!summary.is_object() || !summary.contains("events")) return {};
  EventTimes all;
  for (const auto& e : summary.at("events"))
    all.emplace_back(e.at("event").get<std::string>(), e.at("at_s").get<double>());
  return all;
}

}  // namespace porthos::scene
