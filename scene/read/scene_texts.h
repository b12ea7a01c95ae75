#pragma once
#include <filesystem>
#include <string>

#include "scene/read/scene.h"

namespace porthos::scene {

/// The input texts that a results file stores; files that are missing in it are searched.
struct SceneTexts {
  std::string scene, urdf;
  InputFiles files = {};
};

/// The texts of a scene as files of a folder, as an unfinished run keeps them beside its
/// checkpoint. @throws IoError or InvalidArgument, which name the file
void write_texts(const std::filesystem::path& folder, const Scene& scene);
SceneTexts texts_beside(const std::filesystem::path& folder);

/// A scene from stored texts, as by read_scene(). Neither file is opened, and the scene need not
/// name the model file. No code that it names is loaded: a law of the user's own gives no torque,
/// so that the results of others can be looked at. `path` stands for the scene file in messages.
/// @throws InvalidArgument as read_scene()
Scene read_scene_again(const std::string& path, const SceneTexts& kept);

}  // namespace porthos::scene
