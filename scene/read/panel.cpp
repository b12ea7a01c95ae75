#include "scene/read/panel.h"

#include <fmt/format.h>

#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

std::vector<mechanics::Panel> read_panels(const Table& scene) {
  std::vector<mechanics::Panel> list;
  scene.each_of("panel", "name", [&](const std::string& name, const Table& t) {
    mechanics::Panel p;
    p.name = name;
    p.where = t.where();
    p.link = t.text("link", "the name of a link");
    const Vec3d x = t.direction("along"), y = t.direction("hinge_axis");
    if (std::fabs(dot(x, y)) > 1e-9)
      t.fail(t.has("hinge_axis") ? "hinge_axis" : "along",
             "is not at right angles to the other axis, expected along and hinge_axis to be");
    p.root = {{x, y, cross(x, y)}, t.vector("at")};
    p.length = t.positive("length");
    p.width = t.not_negative("width");
    p.mass = t.positive("mass");
    p.bending_stiffness = t.positive("bending_stiffness");
    const std::uint64_t n = t.whole("segments");
    if (n < 1 || n > 1000) t.fail("segments", fmt::format("is {}, expected 1 to 1000", n));
    p.segments = int(n);
    p.damping_ratio = t.not_negative("damping_ratio");
    list.push_back(std::move(p));
  });
  return list;
}

}  // namespace porthos::scene
