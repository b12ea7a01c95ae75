#include "report/detail/shapes.h"
#include "mechanics/kinematics.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

namespace porthos::report {
namespace {

using mechanics::Mat3;
using mechanics::Vec3d;
using tinyxml2::XMLElement;

Json place(const Vec3d& p) { return {p.x, p.y, p.z}; }

Mat3<double> columns(const Eigen::Matrix3d& m) {
  return {{m(0, 0), m(1, 0), m(2, 0)}, {m(0, 1), m(1, 1), m(2, 1)}, {m(0, 2), m(1, 2), m(2, 2)}};
}

/// Where a body's joints are.
struct Joints {
  bool root = true;  ///< nothing carries it
  double reach = 0;  ///< from its centre of mass to the farthest joint [m]
};

/// The sides of a box as they are drawn: moments that are placeholders or identified make boxes
/// much larger than the body. One lighter than any foam (of a root: than air) that goes beyond the
/// joints gets the volume of a usual link. Upon a joint no side is longer than three times the
/// reach and twice the side of a cube of that volume, except of thin sheets.
void bound(std::array<double, 3>& side, double mass, const Joints& j) {
  constexpr double foam = 50, air = 1, usual = 500;  // kg/m³
  const double longest = *std::ranges::max_element(side);
  double volume = 1;
  for (const double s : side) volume *= std::max(s, longest / 1000);
  if (mass / volume < (j.root ? air : foam) && longest / 2 > j.reach) {
    for (double& s : side) s *= std::cbrt(mass / volume / usual);
    volume = mass / usual;
  }
  if (j.root || *std::ranges::min_element(side) < longest / 50) return;
  for (double& s : side) s = std::min(s, std::max(3 * j.reach, 2 * std::cbrt(volume)));
}

/// The homogeneous box with the body's mass and principal moments: a² = 6 (I_y + I_z - I_x) / m,
/// bounded. For moments that break the triangle inequality there is no box: null. A side is at
/// least a twentieth of the longest.
Json box_of(const mechanics::MassProperties& m, const Joints& joints) {
  if (!(m.mass > 0)) return nullptr;
  Eigen::Matrix3d I;
  const auto& i = m.inertia;
  I << i.xx, i.xy, i.xz, i.xy, i.yy, i.yz, i.xz, i.yz, i.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(I);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  const Eigen::Vector3d& e = solver.eigenvalues();
  std::array<double, 3> side{};
  for (int k = 0; k < 3; ++k) {
    const double square = 6 / m.mass * (e.sum() - 2 * e[k]);
    if (square < -1e-6 * e.sum() / m.mass) return nullptr;
    side[size_t(k)] = std::sqrt(std::max(0.0, square));
  }
  double longest = *std::max_element(side.begin(), side.end());
  if (!(longest > 0) || !std::isfinite(longest)) return nullptr;
  bound(side, m.mass, joints);
  longest = *std::max_element(side.begin(), side.end());
  for (double& s : side) s = std::max(s, longest / 20);
  return {{"size", side}, {"p", place(m.com)}, {"q", quaternion_of(m.axes * columns(axes))}};
}

std::vector<double> numbers(const char* text) {
  std::vector<double> list;
  std::istringstream in(text ? text : "");
  in.imbue(std::locale::classic());
  for (double x = 0; in >> x;) list.push_back(x);
  return list;
}

/// A <visual> as {kind, size, p, q, colour}; a mesh has its scale as size and its number as mesh.
/// Null for what cannot be shown.
Json visual_of(const XMLElement& v, const std::map<std::string, Json>& materials,
               MeshShelf& meshes) {
  const XMLElement* g = v.FirstChildElement("geometry");
  const XMLElement* shape = g ? g->FirstChildElement() : nullptr;
  if (!shape) return nullptr;
  const std::string kind = shape->Name();
  Json size;
  std::optional<size_t> mesh;
  if (kind == "mesh") {
    if (const char* name = shape->Attribute("filename")) mesh = meshes.index(name);
    size = shape->Attribute("scale") ? numbers(shape->Attribute("scale"))
                                     : std::vector<double>{1, 1, 1};
    if (!mesh || size.size() != 3) return nullptr;
  } else if (kind == "box") {
    size = numbers(shape->Attribute("size"));
    if (size.size() != 3) return nullptr;
  } else if (kind == "sphere") {
    size = {shape->DoubleAttribute("radius")};
  } else if (kind == "cylinder" || kind == "capsule") {
    size = {shape->DoubleAttribute("radius"), shape->DoubleAttribute("length")};
  } else {
    return nullptr;
  }
  for (const auto& s : size)  // a mesh may be mirrored
    if (const auto x = s.get<double>(); !(mesh ? x != 0 && std::isfinite(x) : x > 0))
      return nullptr;
  Vec3d p{0, 0, 0};
  Mat3<double> R = Mat3<double>::identity();
  if (const auto* o = v.FirstChildElement("origin")) {
    const auto xyz = numbers(o->Attribute("xyz")), rpy = numbers(o->Attribute("rpy"));
    if (xyz.size() == 3) p = {xyz[0], xyz[1], xyz[2]};
    if (rpy.size() == 3) R = mechanics::rotation_from_rpy(rpy[0], rpy[1], rpy[2]);
  }
  Json j = {{"kind", kind}, {"size", size}, {"p", place(p)}, {"q", quaternion_of(R)}};
  if (mesh) j["mesh"] = *mesh;
  if (const auto* m = v.FirstChildElement("material")) {
    if (const auto* c = m->FirstChildElement("color"))
      j["colour"] = numbers(c->Attribute("rgba"));
    else if (const char* name = m->Attribute("name"); name && materials.count(name))
      j["colour"] = materials.at(name);
  }
  return j;
}

std::map<std::string, Joints> joints_of(const std::vector<mechanics::BodySpec>& bodies) {
  std::map<std::string, Joints> all;
  std::map<std::string, Vec3d> com;
  for (const auto& b : bodies) com[b.name] = b.mass.com;
  for (const auto& b : bodies) {
    const auto parent = com.find(b.parent);
    if (parent == com.end()) continue;
    all[b.name].root = false;
    for (const auto& [name, distance] :
         {std::pair{b.name, norm(b.mass.com)}, {b.parent, norm(b.placement.r - parent->second)}})
      all[name].reach = std::max(all[name].reach, distance);
  }
  return all;
}

/// Whether a contact's shape stands for the body: it holds the middle half of the body's box.
bool stands_for(const contact::Shape& s, const Json& box, const Vec3d& com) {
  if (box.is_null()) return false;
  const auto side = box["size"].get<std::vector<double>>();
  const Vec3d half{side[0] / 2, side[1] / 2, side[2] / 2};
  return norm(s.pose.r - com) + 0.5 * norm(half) <= s.reach();
}

/// The shapes of contacts of a body that are not drawn yet; its box goes where one stands for it.
void add_contacts(const std::vector<contact::Shape>& shapes, const Vec3d& com, Json& body) {
  for (const contact::Shape& s : shapes) {
    if (s.kind == contact::Kind::plane) continue;
    Json shape = drawn(s);
    const bool there = std::ranges::any_of(body["visuals"], [&](const Json& v) {
      return std::ranges::all_of(shape.items(),
                                 [&](const auto& i) { return v[i.key()] == i.value(); });
    });
    if (!there) body["contacts"].push_back(shape);
    if (stands_for(s, body["box"], com)) body["box"] = nullptr;
  }
}

/// By link.
std::map<std::string, Json> visuals_of(const std::string& urdf, MeshShelf& meshes) {
  std::map<std::string, Json> all, materials;
  tinyxml2::XMLDocument document;
  if (urdf.empty() || document.Parse(urdf.data(), urdf.size()) != tinyxml2::XML_SUCCESS) return all;
  const XMLElement* robot = document.RootElement();
  if (!robot) return all;
  for (auto* m = robot->FirstChildElement("material"); m; m = m->NextSiblingElement("material"))
    if (const auto* c = m->FirstChildElement("color"); c && m->Attribute("name"))
      materials[m->Attribute("name")] = numbers(c->Attribute("rgba"));
  for (auto* link = robot->FirstChildElement("link"); link;
       link = link->NextSiblingElement("link")) {
    if (!link->Attribute("name")) continue;
    Json list = Json::array();
    for (const char* tag : {"visual", "collision"}) {
      if (!list.empty()) break;
      for (auto* v = link->FirstChildElement(tag); v; v = v->NextSiblingElement(tag))
        if (auto drawn = visual_of(*v, materials, meshes); !drawn.is_null()) list.push_back(drawn);
    }
    if (!list.empty()) all[link->Attribute("name")] = list;
  }
  return all;
}

}  // namespace

Json drawn(const contact::Shape& s) {
  Json size = Json::array();
  if (s.kind == contact::Kind::box)
    size = place(2.0 * s.half);
  else if (s.kind != contact::Kind::plane)
    size.push_back(s.radius);
  if (s.kind == contact::Kind::capsule || s.kind == contact::Kind::cylinder)
    size.push_back(2 * s.half_length);
  return {{"kind", contact::to_string(s.kind)},
          {"size", size},
          {"p", place(s.pose.r)},
          {"q", quaternion_of(s.pose.R)}};
}

Json shapes_of(const std::vector<mechanics::BodySpec>& bodies, const std::string& urdf,
               const std::map<std::string, std::vector<contact::Shape>>& touching,
               MeshShelf& meshes) {
  const auto visuals = visuals_of(urdf, meshes);
  auto joints = joints_of(bodies);
  Json list = Json::array();
  std::map<std::string, size_t> at;
  for (const auto& b : bodies) {
    at[b.name] = list.size();
    Json j = {{"name", b.name},           {"parent", b.parent},
              {"joint", b.joint.type},    {"mass", b.mass.mass},
              {"com", place(b.mass.com)}, {"box", box_of(b.mass, joints[b.name])},
              {"visuals", Json::array()}, {"contacts", Json::array()},
              {"joints", Json::array()}};
    if (const auto v = visuals.find(b.name); v != visuals.end()) j["visuals"] = v->second;
    if (const auto s = touching.find(b.name); s != touching.end())
      add_contacts(s->second, b.mass.com, j);
    list.push_back(j);
  }
  for (const auto& b : bodies)
    if (const auto parent = at.find(b.parent); parent != at.end())
      list[parent->second]["joints"].push_back(place(b.placement.r));
  return list;
}

}  // namespace porthos::report
