#include "report/detail/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <unordered_map>

#include "phs/error.h"
#include "scene/files/files.h"

namespace porthos::report {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t largest_file = 256u << 20;
constexpr size_t most_corners = 65535;  // their indices are stored in 16 bits

/// The cells of a grid over a box, `along` of them on its longest side.
class Grid {
 public:
  Grid(const Mesh& mesh, int along) : box_(extent_of(mesh)) {
    per_metre_ = box_.longest > 0 ? along / box_.longest : 0;
  }
  std::uint64_t cell(const std::array<double, 3>& c) const {
    std::uint64_t at = 0;
    for (size_t k = 0; k < 3; ++k)
      at = (at << 20) | std::uint64_t((c[k] - box_.low[k]) * per_metre_);
    return at;
  }

 private:
  Extent box_;
  double per_metre_;
};

Mesh clustered(const Mesh& mesh, int along) {
  const Grid grid(mesh, along);
  Mesh coarse;
  std::vector<std::uint32_t> to(mesh.corners.size());
  std::vector<double> count;
  std::unordered_map<std::uint64_t, std::uint32_t> cells;
  for (size_t i = 0; i < to.size(); ++i) {
    const auto [at, fresh] =
        cells.emplace(grid.cell(mesh.corners[i]), std::uint32_t(coarse.corners.size()));
    if (fresh) {
      coarse.corners.push_back({0, 0, 0});
      count.push_back(0);
    }
    to[i] = at->second;
    for (size_t k = 0; k < 3; ++k) coarse.corners[to[i]][k] += mesh.corners[i][k];
    ++count[to[i]];
  }
  for (size_t i = 0; i < count.size(); ++i)
    for (double& x : coarse.corners[i]) x /= count[i];
  for (const auto& t : mesh.triangles) {
    // Beginning with the smallest index, so that equal triangles are equal.
    std::array<std::uint32_t, 3> c{to[t[0]], to[t[1]], to[t[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    coarse.triangles.push_back(c);
  }
  std::sort(coarse.triangles.begin(), coarse.triangles.end());
  coarse.triangles.erase(std::unique(coarse.triangles.begin(), coarse.triangles.end()),
                         coarse.triangles.end());
  return coarse;
}

/// "NAME/REST" in a folder: as it stands there, or without NAME if the folder is NAME itself.
fs::path in_package(const fs::path& folder, const std::string& name, const fs::path& rest) {
  std::error_code e;
  if (fs::is_regular_file(folder / name / rest, e)) return folder / name / rest;
  if (folder.filename() == name && fs::is_regular_file(folder / rest, e)) return folder / rest;
  return {};
}

fs::path package_file(const std::string& name, const fs::path& rest,
                      const std::vector<fs::path>& folders) {
  for (const auto& folder : folders)
    for (fs::path at = fs::absolute(folder.empty() ? "." : folder).lexically_normal();;
         at = at.parent_path()) {
      if (const auto found = in_package(at, name, rest); !found.empty()) return found;
      if (at == at.root_path() || at.empty()) break;
    }
  if (const char* paths = std::getenv("ROS_PACKAGE_PATH")) {
    std::istringstream list(paths);
    for (std::string folder; std::getline(list, folder, ':');)
      if (const auto found = in_package(folder, name, rest); !found.empty()) return found;
  }
  return {};
}

}  // namespace

Extent extent_of(const Mesh& mesh) {
  auto low = mesh.corners.front(), high = low;
  for (const auto& c : mesh.corners)
    for (size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], c[k]);
      high[k] = std::max(high[k], c[k]);
    }
  return {low, std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]})};
}

Mesh simplified(Mesh mesh, size_t most) {
  if (mesh.triangles.size() <= most && mesh.corners.size() <= most_corners) return mesh;
  // A closed surface over n cells a side has about 6 n² of them and 12 n² triangles.
  for (int along = int(std::sqrt(double(most) / 3)); along > 1; along = along * 4 / 5) {
    Mesh coarse = clustered(mesh, along);
    if (coarse.triangles.size() <= most && coarse.corners.size() <= most_corners) return coarse;
  }
  return clustered(mesh, 1);
}

Mesh read_mesh(const fs::path& file) {
  std::error_code e;
  if (const auto size = fs::file_size(file, e); !e && size > largest_file)
    throw InvalidArgument(
        fmt::format("{}: it has {} MB, expected at most 256", file.string(), size >> 20));
  return parse_mesh(scene::read_file(file), file);
}

fs::path mesh_file(const std::string& name, const std::vector<fs::path>& folders) {
  std::error_code e;
  const auto after = [&](std::string_view scheme) { return name.substr(scheme.size()); };
  if (name.rfind("package://", 0) == 0) {
    const std::string path = after("package://");
    const auto slash = path.find('/');
    if (slash == path.npos) return {};
    return package_file(path.substr(0, slash), path.substr(slash + 1), folders);
  }
  const fs::path path = name.rfind("file://", 0) == 0 ? after("file://") : name;
  if (path.is_absolute()) return fs::is_regular_file(path, e) ? path : fs::path();
  for (const auto& folder : folders)
    if (fs::is_regular_file(folder / path, e)) return folder / path;
  return {};
}

}  // namespace porthos::report
