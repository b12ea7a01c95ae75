#include "mechanics/builder.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// One number for all axes, or three.
Vec3d three(const Table& t, const char* key) {
  if (!t.has(key)) return {0, 0, 0};
  Vec3d k{0, 0, 0};
  try {
    const double x = t.number(key);
    k = {x, x, x};
  } catch (const InvalidArgument&) {
    const auto x = t.numbers<3>(key);
    k = {x[0], x[1], x[2]};
  }
  for (int i = 0; i < 3; ++i)
    if (k[i] < 0) t.fail(key, fmt::format("is {}, expected 0 or more", k[i]));
  return k;
}
mechanics::Pose frame(const Table& t, const char* place, const char* rpy) {
  const Vec3d a = t.vector(rpy);
  return {mechanics::rotation_from_rpy(a.x, a.y, a.z), t.vector(place)};
}
void read_soft_latch(const Table& t, Element& e) {
  space::SoftLatch x;
  x.name = e.name;
  x.link = t.text("link", "the name of a link");
  x.body = t.text("body", "the name of a link");
  for (const char* key : {"link", "body"})
    if (t.text(key, "the name of a link") == "world")
      t.fail(key, "is \"world\", expected the name of a link");
  x.on_link = frame(t, "on_link", "on_link_rpy");
  x.on_body = frame(t, "on_body", "on_body_rpy");
  x.stiffness = three(t, "stiffness");
  x.turning_stiffness = three(t, "turning_stiffness");
  x.damping = three(t, "damping");
  x.turning_damping = three(t, "turning_damping");
  double any = 0;
  for (const Vec3d& k : {x.stiffness, x.turning_stiffness, x.damping, x.turning_damping})
    any += k.x + k.y + k.z;
  if (!(any > 0)) refuse(t.where(), t.label() + " does nothing, expected a stiffness or a damping");
  e.latch = x;
}

}  // namespace

ElementType soft_latch_element() {
  using namespace keys;
  return {
      "soft_latch",
      "Springs and dampers in six degrees of freedom between two links.",
      ElementType::Place::link,
      {text("link", required, ""), text("body", required, "another link, or a [[body]]"),
       numbers("on_link", 3, "m", "[0, 0, 0]", "frame that coincides at rest"),
       numbers("on_link_rpy", 3, "rad", "[0, 0, 0]", "roll, pitch, yaw"),
       numbers("on_body", 3, "m", "[0, 0, 0]", "the other frame"),
       numbers("on_body_rpy", 3, "rad", "[0, 0, 0]", "roll, pitch, yaw"),
       axes("stiffness", "N/m", "along the frame's axes, one number or three"),
       axes("turning_stiffness", "N m/rad", "about them"), axes("damping", "N s/m", "along them"),
       axes("turning_damping", "N m s/rad", "about them")},
      read_soft_latch};
}

}  // namespace porthos::scene
