#include "scene/read/controllers/support.h"

#include <fmt/format.h>

#include <algorithm>

#include "contact/urdf_shapes.h"
#include "mechanics/kinematics.h"
#include "scene/read/scene.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using contact::Kind;
using contact::Shape;

/// Points of a shape in the link's frame, of a sphere its centre. down: a unit vector in that frame
std::vector<Vec3d> standing_points(const Shape& s, const Vec3d& down) {
  if (s.kind == Kind::sphere) return {s.pose.r};
  const Vec3d d = s.pose.R.tmul(down);
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(d[k]) > std::fabs(d[axis])) axis = k;
  std::vector<Vec3d> corners;
  for (const double u : {-1.0, 1.0})
    for (const double v : {-1.0, 1.0}) {
      double at[3];
      at[axis] = d[axis] > 0 ? s.half[axis] : -s.half[axis];
      at[(axis + 1) % 3] = u * (s.half[(axis + 1) % 3] - s.radius);
      at[(axis + 2) % 3] = v * (s.half[(axis + 2) % 3] - s.radius);
      corners.push_back(s.pose.R * Vec3d{at[0], at[1], at[2]} + s.pose.r);
    }
  return corners;
}

}  // namespace

planning::Support support_of(const Scene& scene, const mechanics::Mechanism& m,
                             std::span<const double> q, const std::string& where,
                             const std::string& name) {
  const auto c = std::ranges::find(scene.contacts, name, &SceneContact::name);
  const auto no = [&](const std::string& why) { refuse(where, "contact '" + name + "' " + why); };
  if (c == scene.contacts.end())
    no("does not exist, expected " +
       (scene.contacts.empty()
            ? "a [[contact]]"
            : "one of: " + listed(scene.contacts, [](const auto& k) { return k.name; })));
  if (!c->law.rigid()) no("is soft, expected law = \"rigid\": a soft foot needs no still point");
  if (c->against != std::vector<std::string>{"world"}) no("is not with the world, expected ground");
  const Shape ground = c->against_shape.value_or(Shape{.kind = Kind::plane});
  if (ground.kind != Kind::plane)
    no(fmt::format("is with a {}, expected a plane", contact::to_string(ground.kind)));
  planning::Support s{name, {}};
  const Vec3d up = ground.pose.R * Vec3d{0, 0, 1};
  mechanics::Workspace<double> w(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  mechanics::forward_kinematics<double>(m, w, q, poses);
  for (const auto& link : c->links) {
    const auto shapes = c->shape ? std::vector<Shape>{*c->shape}
                                 : contact::urdf_shapes(scene.urdf_text, scene.urdf_path, link);
    const auto X = mechanics::body_pose<double>(m, m.body(link), poses);
    for (const Shape& shape : shapes) {
      if (shape.kind != Kind::sphere && shape.kind != Kind::box)
        no(fmt::format("has a {}, expected spheres and boxes", contact::to_string(shape.kind)));
      for (const Vec3d& at : standing_points(shape, X.R.tmul(-1.0 * up))) {
        planning::ContactPoint p;
        p.name = fmt::format("{} {}", name, s.points.size() + 1);
        p.body = link;
        p.position = at;
        if (shape.kind == Kind::sphere) p.radius = shape.radius;
        p.normal = up;
        p.ground = ground.pose.r;
        p.friction = c->law.friction;
        s.points.push_back(p);
      }
    }
  }
  return s;
}

}  // namespace porthos::scene
