#pragma once
#include <filesystem>
#include <string>

namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// The motion of flexible panels as SVG: the distance of the tip of each from its plane [m], and
/// the rates of the base [rad/s]. At most 1500 records.
std::string panel_plot(const Scene& scene, const Assembly& assembly, const RunReport& report,
                       const std::filesystem::path& log);

}  // namespace porthos::scene
