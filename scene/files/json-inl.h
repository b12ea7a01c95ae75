#pragma once
#include <cmath>
#include <nlohmann/json.hpp>

namespace porthos::scene {

/// The number, NaN where there is none: JSON writes NaN as null.
inline double json_number(const nlohmann::ordered_json& j) {
  return j.is_number() ? j.get<double>() : std::nan("");
}

}  // namespace porthos::scene
