#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "report/detail/series.h"

namespace porthos::report {

/// The meshes of a page, each once.
class MeshShelf {
 public:
  /// @param folders  of the model files; empty: no mesh is looked for
  explicit MeshShelf(std::vector<std::filesystem::path> folders) : folders_(std::move(folders)) {}

  /// The number of the mesh that a URDF means by a name; none if it cannot be shown.
  std::optional<std::size_t> index(const std::string& name);

  /// [{low: [x, y, z], step, corners, triangles}]: corners [m] are low + step times three numbers
  /// of 16 bits, triangles three indices of 16 bits.
  const Json& json() const { return meshes_; }
  /// What is not shown, and why for the first five, in one sentence; empty: all is.
  std::string missing() const;

 private:
  std::vector<std::filesystem::path> folders_;
  std::map<std::string, std::optional<std::size_t>> known_;  ///< by the URDF's name
  Json meshes_ = Json::array();
  std::vector<std::string> missing_;  ///< why, of each that is not shown
};

}  // namespace porthos::report
