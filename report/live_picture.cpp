#include "report/live_picture.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "mechanics/kinematics.h"
#include "phs/error.h"
#include "report/detail/playback.h"
#include "report/detail/stage_page.h"

namespace porthos::report {

struct LivePicture::Parts {
  std::shared_ptr<const mechanics::Mechanism> mechanism;
  std::unique_ptr<BrowserPage> page;
  mechanics::Workspace<double> workspace;
  std::vector<mechanics::Transform<double>> pose;
};

LivePicture::LivePicture(std::shared_ptr<const mechanics::Mechanism> mechanism,
                         const std::filesystem::path& report, const FilmOptions& o)
    : parts_(new Parts{mechanism, open_stage(report, o), mechanics::Workspace<double>(*mechanism),
                       std::vector<mechanics::Transform<double>>(mechanism->nodes().size())}),
      width_(o.width),
      height_(o.height) {
  const std::string nodes = parts_->page->value("porthos.data.acts[0].nodes");
  if (nodes != std::to_string(parts_->pose.size()))
    throw InvalidArgument(fmt::format("{} shows {} moving bodies, the mechanism has {}",
                                      report.string(), nodes, parts_->pose.size()));
}

LivePicture::~LivePicture() = default;

std::vector<std::uint8_t> LivePicture::picture(std::span<const double> q) {
  auto& [m, page, w, pose] = *parts_;
  const size_t expected = 3 * size_t(width_) * size_t(height_);
  require_size("q", q.size(), size_t(m->nq()));
  mechanics::forward_kinematics<double>(*m, w, q, pose);
  std::vector<float> poses;
  const mechanics::Vec3d o = origin_of(*m, pose);
  add_poses(pose, o, poses);
  const std::string bytes = bytes_of_base64(
      page->value(fmt::format("porthos.pixels(porthos.stage, {}, {})", nlohmann::json(poses).dump(),
                              nlohmann::json{o.x, o.y, o.z}.dump())));
  if (bytes.size() != expected)
    throw IoError(fmt::format("the browser gave {} bytes for a picture, expected {}", bytes.size(),
                              expected));
  return {bytes.begin(), bytes.end()};
}

}  // namespace porthos::report
