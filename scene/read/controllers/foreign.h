#pragma once
#include <string>

#include "scene/read/controllers/controller_type.h"

namespace porthos::scene {

/// The keys of a law of the user's own: joints, inputs, settings, memory.
std::vector<SchemaKey> foreign_keys();

/// A law of the user's own over joints of the scene.
struct ForeignScene {
  std::vector<std::string> joints, inputs;
  std::string settings;  ///< JSON; empty: none
  size_t memory = 0;     ///< [bytes]; 0: by the law's start
};
ForeignScene read_foreign(const Table& t);

/// @param functions  of the law; null: it is not loaded and gives no torque
/// @param settings  for porthos_law::create
ControllerDesign design_foreign(const Controller& c, const ControllerPlant& plant,
                                const ForeignScene& w, const porthos_law* functions,
                                const std::string& settings);

/// The functions of laws in Python, see use_python_laws().
const porthos_law& python_law_functions();

}  // namespace porthos::scene
