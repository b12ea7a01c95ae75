#pragma once
#include <filesystem>
#include <string>

namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// What flexible panels do, as SVG: how far the tip of each is off its plane [m], and the rates of
/// the base [rad/s]. At no more than 1500 records.
std::string panel_plot(const Scene& scene, const Assembly& assembly, const RunReport& report,
                       const std::filesystem::path& log);

}  // namespace porthos::scene
