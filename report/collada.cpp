#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <cmath>
#include <locale>
#include <map>
#include <numbers>
#include <sstream>

#include "phs/error.h"
#include "report/detail/mesh.h"

/// COLLADA 1.4 (Khronos Group 2008), as far as shapes need it.
namespace porthos::report {
namespace {

using tinyxml2::XMLElement;
using Affine = Eigen::Affine3d;

constexpr int most_nodes = 100000;
constexpr int deepest = 64;                 // of nodes in nodes
constexpr size_t most_triangles = 5000000;  // nodes may draw a geometry again and again

class Collada {
 public:
  Collada(const XMLElement& root, std::string file) : file_(std::move(file)) {
    if (std::string(root.Name()) != "COLLADA") fail("it is no COLLADA file");
    double metre = 1;
    if (const auto* asset = root.FirstChildElement("asset"))
      if (const auto* unit = asset->FirstChildElement("unit"))
        metre = unit->DoubleAttribute("meter", 1);
    know(root);
    const Affine all(Eigen::Scaling(metre));
    for_each(&root, "library_visual_scenes", [&](const XMLElement& library) {
      for_each(&library, "visual_scene", [&](const XMLElement& scene) {
        for_each(&scene, "node", [&](const XMLElement& node) { draw_node(node, all, 0); });
      });
    });
    if (mesh_.triangles.empty())  // no scene: the geometries as they are
      for (const auto& [name, e] : known_)
        if (std::string(e->Name()) == "geometry") draw_geometry(*e, all);
    for (const auto& c : mesh_.corners)
      if (!std::isfinite(c[0] + c[1] + c[2])) fail("a corner is not finite");
  }
  Mesh mesh() { return std::move(mesh_); }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw InvalidArgument(file_ + ": " + why);
  }
  template <class F>
  static void for_each(const XMLElement* parent, const char* name, F f) {
    for (auto* e = parent->FirstChildElement(name); e; e = e->NextSiblingElement(name)) f(*e);
  }
  /// Everything with an id. The reader of XML bounds the depth.
  void know(const XMLElement& e) {
    if (const char* id = e.Attribute("id")) known_[id] = &e;
    for (auto* child = e.FirstChildElement(); child; child = child->NextSiblingElement())
      know(*child);
  }
  const XMLElement& at(const char* url) const {
    if (url && *url == '#')
      if (const auto e = known_.find(url + 1); e != known_.end()) return *e->second;
    fail(fmt::format("there is no '{}'", url ? url : ""));
  }
  template <class Number>
  std::vector<Number> numbers(const XMLElement* e) const {
    std::vector<Number> list;
    std::istringstream in(e && e->GetText() ? e->GetText() : "");
    in.imbue(std::locale::classic());
    for (Number x; in >> x;) list.push_back(x);
    if (!in.eof()) fail(fmt::format("<{}> has something that is no number", e->Name()));
    return list;
  }
  std::vector<double> numbers(const XMLElement& e, size_t count) const {
    const auto list = numbers<double>(&e);
    if (list.size() != count)
      fail(fmt::format("<{}> has {} numbers, expected {}", e.Name(), list.size(), count));
    return list;
  }

  Affine step_of(const XMLElement& e) const {
    const std::string kind = e.Name();
    Affine step = Affine::Identity();
    if (kind == "matrix") {
      const auto m = numbers(e, 16);
      for (int i = 0; i < 12; ++i) step(i / 4, i % 4) = m[size_t(i)];
    } else if (kind == "translate" || kind == "scale") {
      const auto v = numbers(e, 3);
      const Eigen::Vector3d xyz(v[0], v[1], v[2]);
      kind == "scale" ? step.scale(xyz) : step.translate(xyz);
    } else if (kind == "rotate") {
      const auto r = numbers(e, 4);
      const Eigen::Vector3d axis(r[0], r[1], r[2]);
      if (axis.norm() > 0)
        step.rotate(Eigen::AngleAxisd(r[3] * std::numbers::pi / 180, axis.normalized()));
    }
    return step;
  }
  void draw_node(const XMLElement& node, Affine place, int depth) {
    if (depth > deepest || ++nodes_ > most_nodes)
      fail("its nodes are too many, too deep or within themselves");
    for (auto* e = node.FirstChildElement(); e; e = e->NextSiblingElement())
      place = place * step_of(*e);
    for_each(&node, "instance_geometry",
             [&](const XMLElement& e) { draw_geometry(at(e.Attribute("url")), place); });
    for_each(&node, "instance_node",
             [&](const XMLElement& e) { draw_node(at(e.Attribute("url")), place, depth + 1); });
    for_each(&node, "node", [&](const XMLElement& e) { draw_node(e, place, depth + 1); });
  }

  void draw_geometry(const XMLElement& geometry, const Affine& place) {
    for_each(&geometry, "mesh", [&](const XMLElement& mesh) {
      for (const char* kind : {"triangles", "polylist", "polygons"})
        for_each(&mesh, kind, [&](const XMLElement& faces) { draw_faces(faces, place); });
    });
  }
  /// The numbers of <vertices>, three for each corner.
  std::vector<double> corners_of(const XMLElement& vertices) const {
    const XMLElement* source = nullptr;
    for_each(&vertices, "input", [&](const XMLElement& in) {
      if (in.Attribute("semantic", "POSITION")) source = &at(in.Attribute("source"));
    });
    if (!source) fail("<vertices> have no POSITION");
    return numbers<double>(source->FirstChildElement("float_array"));
  }
  void draw_faces(const XMLElement& faces, const Affine& place) {
    std::vector<double> corners;
    size_t offset = 0, stride = 1;
    for_each(&faces, "input", [&](const XMLElement& in) {
      const size_t own = in.UnsignedAttribute("offset", 0);
      if (own > 100) fail("an <input> has an offset above 100");
      stride = std::max(stride, own + 1);
      if (!in.Attribute("semantic", "VERTEX")) return;
      corners = corners_of(at(in.Attribute("source")));
      offset = own;
    });
    const auto first = mesh_.corners.size();
    for (size_t i = 0; i + 2 < corners.size(); i += 3) {
      const Eigen::Vector3d c = place * Eigen::Vector3d(corners[i], corners[i + 1], corners[i + 2]);
      mesh_.corners.push_back({c[0], c[1], c[2]});
    }
    const size_t count = mesh_.corners.size() - first;
    const auto sizes = numbers<std::uint32_t>(faces.FirstChildElement("vcount"));
    const bool polygons = std::string(faces.Name()) == "polygons";  // a <p> each
    size_t face = 0;
    for_each(&faces, "p", [&](const XMLElement& p) {
      const auto list = numbers<std::uint32_t>(&p);
      for (size_t at = 0; at < list.size(); ++face) {
        const size_t size = polygons ? list.size() / stride : face < sizes.size() ? sizes[face] : 3;
        if (size == 0 || at + size * stride > list.size()) fail("a face is cut off");
        std::vector<std::uint32_t> fan;
        for (size_t k = 0; k < size; ++k) {
          const std::uint32_t i = list[at + k * stride + offset];
          if (i >= count) fail(fmt::format("a face names corner {} of {}", i, count));
          fan.push_back(std::uint32_t(first) + i);
        }
        for (size_t k = 2; k < size; ++k) mesh_.triangles.push_back({fan[0], fan[k - 1], fan[k]});
        at += size * stride;
      }
    });
    if (mesh_.triangles.size() > most_triangles || mesh_.corners.size() > most_triangles)
      fail(fmt::format("it draws more than {} triangles", most_triangles));
  }

  std::string file_;
  int nodes_ = 0;
  std::map<std::string, const XMLElement*> known_;
  Mesh mesh_;
};

}  // namespace

Mesh parse_collada(const std::string& bytes, const std::string& file) {
  tinyxml2::XMLDocument document;
  if (document.Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS)
    throw InvalidArgument(fmt::format("{}: it is no XML: {}", file, document.ErrorName()));
  if (!document.RootElement()) throw InvalidArgument(file + ": it is no COLLADA file");
  return Collada(*document.RootElement(), file).mesh();
}

}  // namespace porthos::report
