#pragma once
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The input texts that a results file stores.
struct SceneTexts {
  std::string scene, urdf;
};

/// A scene from stored texts, as by read_scene(). Neither file is opened, and the scene need not
/// name the model file. `path` stands for the scene file in messages; tables of measured actuators
/// are searched beside it. @throws InvalidArgument as read_scene()
Scene read_scene_again(const std::string& path, const SceneTexts& kept);

}  // namespace porthos::scene
