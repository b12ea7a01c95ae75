#include "scene/read/scene_texts.h"

#include "scene/files/files.h"

namespace porthos::scene {

void write_texts(const std::filesystem::path& folder, const Scene& scene) {
  write_file(folder / "scene.toml", scene.text);
  write_file(folder / "model.urdf", scene.urdf_text);
  if (!scene.files.empty()) write_file(folder / "files.json", to_text(scene.files));
}

SceneTexts texts_beside(const std::filesystem::path& folder) {
  const auto files = folder / "files.json";
  return {read_file(folder / "scene.toml"), read_file(folder / "model.urdf"),
          input_files(std::filesystem::exists(files) ? read_file(files) : std::string())};
}

}  // namespace porthos::scene
