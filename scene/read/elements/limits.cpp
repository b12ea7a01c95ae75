#include <fmt/format.h>

#include "mechanics/mechanical_model.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// If the scene does not give a bound, the bound of the model file is used.
phs::Potential soft_stops(const mechanics::MechanicalModel& model, const Element& e,
                          std::optional<double> lower, std::optional<double> upper,
                          double stiffness) {
  for (const auto& j : model.mechanism().joint_properties()) {
    if (j.joint != e.joint) continue;
    if (!lower) lower = j.lower;
    if (!upper) upper = j.upper;
  }
  if (!lower || !upper)
    throw InvalidArgument(
        fmt::format("{}: element '{}': neither the scene nor the model file gives the {} limit of "
                    "joint '{}', expected it here",
                    e.where, e.name, lower ? "upper" : "lower", e.joint));
  return phs::soft_limits(*lower, *upper, stiffness);
}

void read_limits(const Table& t, Element& e) {
  SoftLimits s;
  if (t.has("lower")) s.lower = t.number("lower");
  if (t.has("upper")) s.upper = t.number("upper");
  s.stiffness = t.number("stiffness");
  e.add = s;
}

}  // namespace

void SoftLimits::operator()(const Element& own, const JointElement& at) const {
  at.require_number(own);
  at.network.potential(own.name, at.place.coordinate,
                       soft_stops(at.model, own, lower, upper, stiffness));
}

ElementType limits_element() {
  using namespace keys;
  return {"limits",
          "Soft stops.",
          ElementType::Place::joint,
          {number("lower", "rad (m)", "the model file's", ""),
           number("upper", "rad (m)", "the model file's", ""),
           number("stiffness", "N m/rad² (N/m²)", required, "more than 0")},
          read_limits};
}

}  // namespace porthos::scene
