#include "report/detail/mesh_shelf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "phs/error.h"
#include "report/detail/mesh.h"

namespace porthos::report {
namespace {

constexpr std::size_t finest = 6000;  ///< of a mesh: 50 kB of the page
constexpr double most_steps = 65535;

Json stored(const Mesh& mesh) {
  const auto [low, longest] = extent_of(mesh);
  const double step = longest > 0 ? longest / most_steps : 1;
  std::vector<std::uint16_t> corners, triangles;
  for (const auto& c : mesh.corners)
    for (std::size_t k = 0; k < 3; ++k)
      corners.push_back(std::uint16_t(std::lround((c[k] - low[k]) / step)));
  for (const auto& t : mesh.triangles)
    for (const auto i : t) triangles.push_back(std::uint16_t(i));
  return {{"low", low},
          {"step", step},
          {"corners", base64(corners.data(), sizeof(corners[0]) * corners.size())},
          {"triangles", base64(triangles.data(), sizeof(triangles[0]) * triangles.size())}};
}

}  // namespace

std::optional<std::size_t> MeshShelf::index(const std::string& name) {
  if (const auto at = known_.find(name); at != known_.end()) return at->second;
  auto& index = known_[name];
  std::string why;
  if (folders_.empty())
    why = "the folder of the model file was not given, use porthos report DIR --models FOLDER";
  else if (const auto file = mesh_file(name, folders_); file.empty())
    why = fmt::format("'{}' was not found", name);
  else
    try {
      meshes_.push_back(stored(simplified(read_mesh(file), finest)));
      index = meshes_.size() - 1;
    } catch (const InvalidArgument& e) {
      why = e.what();
    } catch (const IoError& e) {
      why = e.what();
    }
  if (!why.empty() && !(folders_.empty() && missing_.size() == 1)) missing_.push_back(why);
  return index;
}

std::string MeshShelf::missing() const {
  const auto lost =
      std::count_if(known_.begin(), known_.end(), [](const auto& m) { return !m.second; });
  if (lost == 0) return {};
  constexpr std::size_t named = 5;
  const auto end = missing_.begin() + long(std::min(named, missing_.size()));
  return fmt::format("{} of {} meshes of the model are not shown: {}{}", lost, known_.size(),
                     fmt::join(missing_.begin(), end, "; "),
                     missing_.size() > named ? "; ..." : "");
}

}  // namespace porthos::report
