#include "scene/read/joined.h"

#include <nlohmann/json.hpp>

#include "phs/error.h"

namespace porthos::scene {
namespace {

using Json = nlohmann::ordered_json;
using mechanics::Pose;
using mechanics::Vec3d;

/// Rows of R, then r.
Json json_of(const Pose& p) {
  Json j = Json::array();
  for (const Vec3d& row : {p.R.x, p.R.y, p.R.z, p.r})
    for (int k = 0; k < 3; ++k) j.push_back(row[k]);
  return j;
}
Pose pose_of(const Json& j) {
  const auto c = j.get<std::vector<double>>();
  require_size("pose", c.size(), 12);
  const auto row = [&](size_t k) { return Vec3d{c[3 * k], c[3 * k + 1], c[3 * k + 2]}; };
  return {{row(0), row(1), row(2)}, row(3)};
}

}  // namespace

std::string to_text(const Joined& joined) {
  Json j{{"holds", Json::array()}, {"locked", Json::object()}, {"others", joined.others}};
  for (const auto& h : joined.holds)
    j["holds"].push_back(h.joint.empty()
                             ? Json{{"body", h.body}, {"link", h.link}, {"pose", json_of(h.pose)}}
                             : Json{{"joint", h.joint}});
  for (const auto& [block, v] : joined.locked)
    j["locked"][block] = {{"x", v.x}, {"low", v.low}, {"turns", v.turns}};
  return j.dump();
}

Joined joined_of(const std::string& text) {
  Joined joined;
  try {
    const Json j = Json::parse(text);
    for (const Json& h : j.at("holds")) {
      if (h.contains("joint"))
        joined.holds.push_back({"", "", {}, h.at("joint")});
      else
        joined.holds.push_back({h.at("body"), h.at("link"), pose_of(h.at("pose")), ""});
    }
    for (const auto& [block, v] : j.at("locked").items()) {
      if (!v.at("turns").is_number_integer()) throw InvalidArgument("turns are no whole number");
      Joined::Value own{v.at("x"), v.at("low"), v.at("turns")};
      require_size("low words of a locked joint", own.low.size(), own.x.size());
      joined.locked.emplace(block, std::move(own));
    }
    joined.others = j.at("others").get<std::vector<std::string>>();
  } catch (const Json::exception& e) {
    throw InvalidArgument(std::string("what its events had joined cannot be read: ") + e.what());
  }
  return joined;
}

}  // namespace porthos::scene
