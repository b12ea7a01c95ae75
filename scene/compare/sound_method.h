#pragma once
#include <algorithm>
#include <string>

#include "phs/system/system.h"

namespace porthos::scene {

/// The first word of the names of methods that pilots and references are taken from: Gauss
/// collocation, or its counterparts for models with constraints and with rolling ones.
inline std::string sound_word(const phs::Model& model) {
  const auto& all = model.description().constraints;
  if (all.empty()) return "gauss";
  return std::any_of(all.begin(), all.end(), [](const auto& c) { return c.rolling; }) ? "pgauss"
                                                                                      : "spark";
}
/// Its method of an order from 2 to 16: "gauss8", "spark8".
inline std::string sound_method(const phs::Model& model, int order) {
  return sound_word(model) + std::to_string(order);
}

}  // namespace porthos::scene
