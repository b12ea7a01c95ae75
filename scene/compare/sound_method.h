#pragma once
#include <string>

#include "phs/system/system.h"

namespace porthos::scene {

/// The family of methods that pilots and references are taken from: Gauss collocation, or its
/// counterpart for models with constraints.
inline std::string sound_family(bool has_constraints) {
  return has_constraints ? "SPARK, for constraints" : "Gauss collocation";
}
/// Its method of an order from 2 to 16: "gauss8", "spark8".
inline std::string sound_method(const phs::Model& model, int order) {
  return (model.description().constraints.empty() ? "gauss" : "spark") + std::to_string(order);
}

}  // namespace porthos::scene
