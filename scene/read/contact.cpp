#include "scene/read/contact.h"

#include <fmt/format.h>

#include "mechanics/builder.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

contact::Shape read_shape(const Table& t) {
  contact::Shape s;
  const std::string kind = t.choice("kind");
  for (const contact::Kind each :
       {contact::Kind::plane, contact::Kind::sphere, contact::Kind::capsule, contact::Kind::box,
        contact::Kind::cylinder})
    if (kind == contact::to_string(each)) s.kind = each;
  const auto only_for = [&](const char* key, bool is) {
    if (!is && t.has(key)) t.fail(key, fmt::format("is given for a {}, expected none", kind));
  };
  const bool is_long = s.kind == contact::Kind::capsule || s.kind == contact::Kind::cylinder;
  only_for("length", is_long);
  only_for("size", s.kind == contact::Kind::box);
  only_for("radius", s.kind != contact::Kind::plane);
  s.pose.r = t.vector("at");
  const Vec3d a = t.vector("rpy");
  s.pose.R = mechanics::rotation_from_rpy(a.x, a.y, a.z);
  if (is_long) s.half_length = 0.5 * t.positive("length");
  if (s.kind == contact::Kind::box) {
    s.half = 0.5 * t.vector("size");
    s.radius = t.has("radius") ? t.not_negative("radius") : 0;
  } else if (s.kind != contact::Kind::plane) {
    s.radius = t.positive("radius");
  }
  at_line(t.where(), [&] { check(s); });
  return s;
}

contact::Law read_rigid(const Table& t) {
  contact::Law law;
  law.form = contact::Law::Form::rigid;
  for (const char* key : {"stiffness", "loss", "speed"})
    if (t.has(key)) t.fail(key, "is given with law = \"rigid\", expected a soft law or none");
  t.require("restitution", "0 to 1, because the law is \"rigid\"");
  law.restitution = t.number("restitution");
  if (!(law.restitution >= 0 && law.restitution <= 1))
    t.fail("restitution", fmt::format("is {}, expected 0 to 1", law.restitution));
  if (t.choice("simultaneous") == "moreau") law.simultaneous = contact::Simultaneous::moreau;
  return law;
}

}  // namespace

contact::Law read_law(const Table& t) {
  contact::Law law;
  const std::string form = t.choice("law");
  const auto only_with = [&](const char* key, const char* form_of_key) {
    if (form != form_of_key && t.has(key))
      t.fail(key, fmt::format("is given with law = \"{}\", expected law = \"{}\" or none", form,
                              form_of_key));
  };
  only_with("width", "smooth");
  only_with("exponent", "power");
  (void)t.choice("simultaneous");
  only_with("simultaneous", "rigid");
  if (form == "rigid") return read_rigid(t);
  if (form == "smooth") {
    if (!t.has("law"))
      t.require("width",
                "one, as law is \"smooth\" by default; of a hard contact or stop law is "
                "\"rigid\"");
    law.width = t.positive("width");
  } else {
    law.form = contact::Law::Form::power;
    law.exponent = form == "hertz" ? 1.5 : double(t.whole("exponent"));
    if (form == "power" && (law.exponent < 1 || law.exponent > 3))
      t.fail("exponent", fmt::format("is {}, expected 1, 2 or 3", law.exponent));
  }
  if (t.has("stiffness") || form != "hertz") law.stiffness = t.positive("stiffness");
  law.loss = t.not_negative("loss");
  if (t.has("restitution")) {
    if (t.has("loss")) t.fail("loss", "is given with a restitution, expected one of both");
    t.require("speed", "that of the impact whose restitution is stated [m/s]");
    const double e = t.number("restitution"), v = t.positive("speed");
    if (!(e > 0 && e <= 1))
      t.fail("restitution", fmt::format("is {}, expected more than 0, at most 1", e));
    law.loss = contact::loss_for(e, v);
  } else if (t.has("speed")) {
    t.fail("speed", "is given without a restitution, expected both");
  }
  return law;
}

std::vector<SceneContact> read_contacts(const Table& scene) {
  std::vector<SceneContact> list;
  scene.each_of("contact", "name", [&](const std::string& name, const Table& t) {
    SceneContact c;
    c.name = name;
    c.where = t.where();
    for (const SceneContact& other : list)
      if (other.name == name)
        t.fail("name",
               fmt::format("\"{}\" is that of another contact, at {}, expected one of its own",
                           name, other.where));
    t.require("links", "an array of names of links");
    c.links = t.texts("links", "names of links");
    c.against = {"world"};
    if (t.has("against"))
      c.against = t.texts("against", "names of links, \"world\", or \"each other\"");
    for (const auto& [key, names] : {std::pair{"links", &c.links}, {"against", &c.against}})
      if (names->empty()) t.fail(key, "is empty, expected at least one name");
    for (const auto& link : c.links)
      if (link == "world" || link == "each other")
        t.fail("links", fmt::format("has \"{}\", expected it in against", link));
    if (t.has("shape")) c.shape = read_shape(t.table("shape"));
    if (t.has("against_shape")) c.against_shape = read_shape(t.table("against_shape"));
    if (t.has("modulus")) {
      if (t.choice("law") != "hertz")
        t.fail("modulus", "is given without law = \"hertz\", expected both");
      if (t.has("stiffness")) t.fail("modulus", "is given with a stiffness, expected one of both");
      c.modulus = t.positive("modulus");
    } else if (t.choice("law") == "hertz") {
      t.require("stiffness", "one, or a modulus, because the law is \"hertz\"");
    }
    c.law = read_law(t);
    if (c.law.rigid() && t.has("creep"))
      t.fail("creep", "is given with law = \"rigid\", which sticks: expected a soft law or none");
    c.law.friction = t.not_negative("friction");
    if (c.law.rigid() && c.law.friction > 0 && t.has("simultaneous"))
      t.fail("simultaneous",
             "is given with friction, whose impacts come one after another: expected one of both");
    if (c.law.friction > 0 && !c.law.rigid())
      c.law.creep = t.positive("creep");
    else if (t.has("creep"))
      t.fail("creep", "is given without friction, expected both");
    list.push_back(std::move(c));
  });
  return list;
}

}  // namespace porthos::scene
