#include "scene/read/joint_place.h"

#include <fmt/format.h>

#include <algorithm>

#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates;
using mechanics::Mechanism;

bool is_number(const JointCoordinates& c) { return c.nq == 1 && c.nv == 1; }

/// The port of the joint that has the freedoms v ... v + size - 1, in the network.
JointPlace place_at(const mechanics::MechanicalModel& model, const JointCoordinates& c, int v,
                    int size) {
  for (const auto& p : model.description().ports) {
    if (v < p.at || v >= p.at + p.size) continue;
    JointPlace at{"", "mechanism." + p.name, c.q, v - p.at, size, p.size};
    if (is_number(c) || size == c.nv) at.coordinate = "mechanism." + c.name;
    if (size == 1 && p.size > 1) at.port += fmt::format("[{}]", at.first);
    return at;
  }
  throw InvalidArgument("'" + c.name + "' has no port");
}

/// Free in the world, beside a free base: the centre of mass may be taken out of its equations.
bool floats(const Mechanism& m, const JointCoordinates& c) {
  const auto& all = m.coordinates();
  const bool free_base = std::any_of(all.begin(), all.end(), [](const JointCoordinates& k) {
    return k.joint == mechanics::base_joint_name;
  });
  const bool on_world = m.nodes()[size_t(c.node)].parent < 0;
  const bool free =
      std::count_if(all.begin(), all.end(),
                    [&](const JointCoordinates& k) { return k.node == c.node; }) == 2 &&
      c.nv == 3;
  return free_base && on_world && free;
}

}  // namespace

std::vector<JointFreedom> freedoms_of(const Mechanism& m) {
  std::vector<JointFreedom> all;
  for (const auto& c : m.coordinates()) {
    if (is_number(c)) {
      all.push_back({c.name, &c, c.v});
      continue;
    }
    const char* how = c.kind == phs::BlockKind::rotation ? "about" : "along";
    for (int k = 0; k < c.nv; ++k)
      all.push_back({fmt::format("{}.{}_{}", c.joint, how, "xyz"[k]), &c, c.v + k});
  }
  return all;
}

JointPlace joint_place(const mechanics::MechanicalModel& model, const std::string& where,
                       const std::string& who, const std::string& joint) {
  std::string known;
  for (const auto& c : model.mechanism().coordinates()) {
    if (!is_number(c)) continue;
    add_to_list(known, c.name);
    if (c.name == joint) return place_at(model, c, c.v, 1);
  }
  throw InvalidArgument(fmt::format(
      "{}: {}: the model has no joint '{}' of one degree of freedom, expected one of: {}", where,
      who, joint, known.empty() ? "(none)" : known));
}

JointPlace element_place(const mechanics::MechanicalModel& model, const std::string& where,
                         const std::string& who, const std::string& joint) {
  const Mechanism& m = model.mechanism();
  std::string known, own;
  const auto check = [&](const JointCoordinates& c) {
    if (floats(m, c))
      throw InvalidArgument(fmt::format(
          "{}: {}: '{}' floats freely in space, expected a joint between two links (on a link acts "
          "an element of type \"wrench\")",
          where, who, c.joint));
  };
  for (const auto& c : m.coordinates()) {
    if (c.name == joint) {
      check(c);
      return place_at(model, c, c.v, c.nv);
    }
    if (!floats(m, c)) add_to_list(known, c.name);
    if (c.joint == joint) {
      check(c);
      add_to_list(own, c.name);
    }
  }
  for (const auto& f : freedoms_of(m)) {
    if (f.name == joint) {
      check(*f.of);
      return place_at(model, *f.of, f.v, 1);
    }
    if (f.of->joint == joint && !f.has_coordinate()) add_to_list(own, f.name);
  }
  if (!own.empty())
    throw InvalidArgument(fmt::format(
        "{}: {}: joint '{}' has several coordinates, expected one of: {}", where, who, joint, own));
  throw InvalidArgument(fmt::format("{}: {}: the model has no joint '{}', expected one of: {}",
                                    where, who, joint, known.empty() ? "(none)" : known));
}

bool has_place(const Mechanism& m, const std::string& joint) {
  for (const auto& c : m.coordinates())
    if (c.name == joint) return true;
  for (const auto& f : freedoms_of(m))
    if (f.name == joint) return true;
  return false;
}

}  // namespace porthos::scene
