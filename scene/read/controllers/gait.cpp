#include "scene/read/controllers/gait.h"

#include <fmt/format.h>

#include <cmath>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {

std::shared_ptr<const planning::Gait> gait_of(const mechanics::Mechanism& m,
                                              const planning::GaitDesign& design,
                                              std::vector<planning::Support>& supports,
                                              std::span<const double> start) {
  mechanics::Workspace<double> work(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  mechanics::forward_kinematics<double>(m, work, start, poses);
  const Vec3d g = m.gravity();
  std::vector<Vec3d> feet;
  for (auto& s : supports) {
    Vec3d middle{0, 0, 0};
    for (const auto& p : s.points) {
      if (p.body != s.points[0].body)
        throw InvalidArgument(
            fmt::format("a foot of a gait is one link, but contact '{}' has several", s.name));
      if (std::hypot(p.normal.x, p.normal.y) > 1e-9 || !(p.normal.z > 0) || g.x != 0 || g.y != 0)
        throw InvalidArgument(fmt::format(
            "a gait is on level ground, expected gravity and the normal of '{}' along z", s.name));
      const auto X = mechanics::body_pose<double>(m, m.body(p.body), poses);
      middle += (1 / double(s.points.size())) * (X.R * p.position + X.r - p.radius * p.normal);
      const auto xi = mechanics::quaternion_of(X.R);
      s.attitude = mechanics::Quaternion<double>::load(xi.data());
    }
    middle.z = s.points[0].ground.z;
    feet.push_back(middle);
  }
  if (feet.empty()) throw InvalidArgument("a gait needs feet, expected contacts = [...]");
  const auto centre = mechanics::centre_of_mass<double>(m, work, start);
  const double height = centre.z - feet[0].z;
  return std::make_shared<const planning::Gait>(design, std::move(feet), height, -g.z);
}

planning::GaitDesign read_gait(const Table& t, size_t feet) {
  planning::GaitDesign g;
  t.require("period", "the time in which each foot swings once, in s");
  g.period = t.positive("period");
  g.duty = t.positive("duty");
  g.swing = t.list("swing");
  if (g.swing.size() != feet)
    t.fail("swing", fmt::format("has {} numbers, expected one for each of contacts, {}",
                                g.swing.size(), feet));
  if (t.has("velocity")) {
    const auto v = t.list("velocity");
    if (v.size() != 2) t.fail("velocity", fmt::format("has {} numbers, expected 2", v.size()));
    g.velocity = {v[0], v[1]};
  }
  g.clearance = t.positive("clearance");
  g.reach = t.positive("reach");
  g.spacing = t.not_negative("spacing");
  g.start = t.not_negative("start");
  g.when_pushed = t.choice("when") == "pushed";
  g.margin = t.not_negative("margin");
  return g;
}

SchemaTable gait_table() {
  using namespace keys;
  return {
      "controller.whole_body.gait",
      "[controller.gait]",
      "Steps on level ground: each foot, one of contacts, swings once in a period and lands where "
      "the capture point (x + x'/ω of the centre of mass) has its steady offset from it.",
      {number("period", "s", required, "in which each foot swings once"),
       number("duty", "1", "0.6", "the part of the period in which a foot stands"),
       list("swing", "1", required,
            "in the order of contacts: when a swing begins, as part of the period"),
       list("velocity", "m/s", "[0, 0]", "along x and y, that is wanted of the centre of mass"),
       number("clearance", "m", "0.05", "of a foot in the middle of its swing"),
       number("reach", "m", "0.3", "how far from its place under the centre of mass a foot lands"),
       number("spacing", "1", "0.7", "the least distance of feet, as part of that at the start"),
       number("start", "s", "0", "the first step; it stands until then"),
       word("when", {"always", "pushed"}, "\"always\"",
            "\"pushed\": where the capture point comes near the edge of the feet"),
       number("margin", "m", "0.03",
              "of when = \"pushed\": how near; twice as far inside it ends")}};
}

}  // namespace porthos::scene
