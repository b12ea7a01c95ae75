#include "scene/read/robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "mechanics/urdf.h"
#include "scene/files/files.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// Its text, once it is known to be a model.
std::string model_of(const Table& t, const std::string& path, bool free) {
  using Base = mechanics::UrdfOptions::Base;
  try {
    auto text = read_file(path);
    mechanics::UrdfOptions o;
    o.base = free ? Base::free : Base::fixed;
    o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
    o.accept_unphysical_inertia = true;  // as [model] says, once they are together
    (void)mechanics::parse_urdf(text, path, o);
    return text;
  } catch (const InvalidArgument& e) {
    refuse(t.at("urdf"), e.what());
  }
}

}  // namespace

std::vector<Robot> read_robots(const Table& scene, const std::string& beside, bool merged,
                               std::string& urdf) {
  std::vector<Robot> list;
  scene.each_of("robot", "name", [&](const std::string& name, const Table& t) {
    Robot r;
    r.name = name;
    r.where = t.where();
    if (name.empty() || name == "world" || name == mechanics::base_joint_name)
      t.fail("name", fmt::format("is \"{}\", expected another one", name));
    for (const Robot& other : list)
      if (other.name == name)
        t.fail("name",
               fmt::format("\"{}\" is that of another robot, expected one of its own", name));
    r.free = t.choice("base") == "free";
    mechanics::OtherRobot place{name, r.free};
    if (r.free) {
      if (t.has("rpy")) t.fail("rpy", "is of a fixed base, expected attitude_wxyz");
      r.start = read_base_start(t);
      r.start.where = r.where;
    } else {
      for (const char* key : {"attitude_wxyz", "linear_velocity", "angular_velocity"})
        if (t.has(key)) t.fail(key, "is of a free base, expected position and rpy of a fixed one");
      place.at = t.vector("position");
      place.rpy = t.vector("rpy");
    }
    list.push_back(std::move(r));
    const auto file = t.text("urdf", "the name of a URDF file");
    if (merged) return;
    const auto path = (std::filesystem::path(beside) / file).string();
    urdf = mechanics::with_robot(urdf, model_of(t, path, place.free), path, place);
  });
  return list;
}

void require_free(const std::vector<Robot>& robots, const std::string& key) {
  for (size_t k = 0; k < robots.size(); ++k)
    if (!robots[k].free && key.starts_with(fmt::format("robot[{}].", k)))
      throw InvalidArgument(
          fmt::format("robot '{}' is fixed to the world, a part of the model that stays as it is: "
                      "expected a robot with base = \"free\", or another scene",
                      robots[k].name));
}

}  // namespace porthos::scene
