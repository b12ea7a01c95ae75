#pragma once
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The texts a results file keeps of what was run.
struct SceneTexts {
  std::string scene, urdf;
};

/// A scene from texts that were kept, as read_scene(): neither file is opened, and the first need
/// not name the second. `path` stands for the scene file in messages, and tables of measured
/// actuators are looked for beside it. @throws InvalidArgument as read_scene()
Scene read_scene_again(const std::string& path, const SceneTexts& kept);

}  // namespace porthos::scene
