#include "contact/urdf_shapes.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <locale>
#include <sstream>

#include "mechanics/builder.h"

namespace porthos::contact {
namespace {

using tinyxml2::XMLElement;

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  [[noreturn]] void fail(const XMLElement* at, const std::string& why) const {
    throw InvalidArgument(fmt::format("{}:{}: {}", file_, at->GetLineNum(), why));
  }
  std::vector<double> numbers(const XMLElement* at, const char* name, size_t count) const {
    const char* text = at->Attribute(name);
    std::vector<double> list;
    std::istringstream in(text ? text : "");
    in.imbue(std::locale::classic());
    for (double x = 0; in >> x;) list.push_back(x);
    if (list.size() != count || !in.eof())
      fail(at, fmt::format("{} of <{}> is \"{}\", expected {} number{}", name, at->Name(),
                           text ? text : "", count, count == 1 ? "" : "s"));
    return list;
  }
  Pose origin(const XMLElement* o) const {
    Pose pose{Mat3<double>::identity(), {0, 0, 0}};
    if (!o) return pose;
    if (o->Attribute("xyz")) {
      const auto x = numbers(o, "xyz", 3);
      pose.r = {x[0], x[1], x[2]};
    }
    if (o->Attribute("rpy")) {
      const auto a = numbers(o, "rpy", 3);
      pose.R = mechanics::rotation_from_rpy(a[0], a[1], a[2]);
    }
    return pose;
  }
  Shape shape(const XMLElement* collision) const {
    const XMLElement* geometry = collision->FirstChildElement("geometry");
    const XMLElement* s = geometry ? geometry->FirstChildElement() : nullptr;
    if (!s) fail(collision, "<collision> has no geometry, expected one");
    Shape shape;
    shape.pose = origin(collision->FirstChildElement("origin"));
    const std::string kind = s->Name();
    if (kind == "sphere") {
      shape.kind = Kind::sphere;
    } else if (kind == "box") {
      shape.kind = Kind::box;
      const auto size = numbers(s, "size", 3);
      shape.half = 0.5 * Vec3d{size[0], size[1], size[2]};
    } else if (kind == "cylinder" || kind == "capsule") {
      shape.kind = kind == "capsule" ? Kind::capsule : Kind::cylinder;
      shape.half_length = 0.5 * numbers(s, "length", 1)[0];
    } else {
      fail(s, fmt::format("the shape is a <{}>, expected a sphere, box, cylinder or capsule for "
                          "contact",
                          kind));
    }
    if (kind != "box") shape.radius = numbers(s, "radius", 1)[0];
    try {
      check(shape);
    } catch (const InvalidArgument& e) {
      fail(s, e.what());
    }
    return shape;
  }

 private:
  const std::string& file_;
};

}  // namespace

std::vector<Shape> urdf_shapes(const std::string& text, const std::string& file,
                               const std::string& link) {
  const Reader reader(file);
  tinyxml2::XMLDocument document;
  const bool parsed = document.Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS;
  const XMLElement* robot = parsed ? document.RootElement() : nullptr;
  std::vector<Shape> shapes;
  if (robot)
    for (auto* l = robot->FirstChildElement("link"); l; l = l->NextSiblingElement("link")) {
      if (!l->Attribute("name", link.c_str())) continue;
      for (auto* c = l->FirstChildElement("collision"); c; c = c->NextSiblingElement("collision"))
        shapes.push_back(reader.shape(c));
      if (shapes.empty())
        reader.fail(l, fmt::format("link '{}' has no <collision>, expected one or a shape", link));
      return shapes;
    }
  throw InvalidArgument(fmt::format(
      "{}: there is no link '{}' with a <collision>, expected one or a shape", file, link));
}

}  // namespace porthos::contact
