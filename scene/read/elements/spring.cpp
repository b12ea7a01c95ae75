#include <array>
#include <optional>

#include "mechanics/mechanical_model.h"
#include "phs/functions/smoothing.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

[[noreturn]] void refuse_key(const Element& e, const std::string& key, const std::string& why) {
  throw InvalidArgument("element '" + e.name + "': " + key + " is given at '" + e.joint + "', " +
                        why);
}

/// A ball joint, or the attitude or the position of a free joint: an isotropic spring.
struct BlockRest {
  double stiffness;
  std::optional<std::array<double, 4>> attitude = {};
  std::optional<std::array<double, 3>> position = {};
  std::string of_one;  ///< a key that only a coordinate of one number has

  void add(const Element& e, const JointElement& at) const {
    const bool turns = at.model.mechanism().coordinate(e.joint).kind == phs::BlockKind::rotation;
    if (!of_one.empty())
      refuse_key(e, of_one,
                 std::string("which is a coordinate of several numbers, expected stiffness and ") +
                     (turns ? "rest_attitude_wxyz" : "rest_position"));
    if (turns ? position.has_value() : attitude.has_value())
      refuse_key(e, turns ? "rest_position" : "rest_attitude_wxyz",
                 turns ? "which is an attitude, expected rest_attitude_wxyz"
                       : "which is a position, expected rest_position");
    at.network.potential(
        e.name, at.place.coordinate,
        turns ? phs::attitude_spring(stiffness, attitude.value_or(std::array{1.0, 0.0, 0.0, 0.0}))
              : phs::place_spring(stiffness, position.value_or(std::array{0.0, 0.0, 0.0})));
  }
  /// A key that only a coordinate of several numbers has.
  const char* of_several() const {
    return attitude ? "rest_attitude_wxyz" : position ? "rest_position" : nullptr;
  }
};

void read_spring(const Table& t, Element& e) {
  BlockRest block{t.has("stiffness") ? t.number("stiffness") : 0, {}, {}, {}};
  for (const char* key : {"rest", "cubic", "elongation", "force"})
    if (t.has(key)) block.of_one = key;
  if (t.has("rest_attitude_wxyz")) block.attitude = t.numbers<4>("rest_attitude_wxyz");
  if (t.has("rest_position")) block.position = t.numbers<3>("rest_position");
  const auto add = [&](phs::Potential potential) {
    e.add = [potential, block](const Element& own, const JointElement& at) {
      if (at.place.size > 1) return block.add(own, at);
      at.require_number(own);
      if (const char* key = block.of_several())
        refuse_key(own, key, "which is a coordinate of one number, expected rest");
      at.network.potential(own.name, at.place.coordinate, potential);
    };
  };
  if (!t.has("elongation") && !t.has("force"))
    return add(phs::spring(t.number("stiffness"), t.number("rest"), t.number("cubic")));
  for (const char* key : {"stiffness", "rest", "cubic"})
    if (t.has(key)) t.fail(key, "is given with a table of forces, expected one of both");
  const auto z = t.list("elongation"), force = t.list("force");
  add(phs::tabulated_spring(z, force));
  e.table = true;
  if (const double off = phs::slope_error(z, force); off > phs::much_slope_error)
    e.remark = fmt::format(
        "neighbouring forces scatter and are met exactly, so the stiffness is off by about "
        "{:.0f} %: smooth them before",
        100 * off);
}

}  // namespace

ElementType spring_element() {
  using namespace keys;
  return {
      "spring",
      "An elastic energy: at a coordinate of one number, or isotropic at one of several.",
      ElementType::Place::joint,
      {number("stiffness", "N m/rad (N/m)", "required, or a table", "0 or more"),
       number("rest", "rad (m)", "0", "where it is slack"),
       numbers("rest_attitude_wxyz", 4, "1", "[1, 0, 0, 0]",
               "the same at a ball joint or an attitude; normalised"),
       numbers("rest_position", 3, "m", "[0, 0, 0]", "the same at the position of a free joint"),
       number("cubic", "N m/rad³ (N/m³)", "0", "0 or more"),
       list("elongation", "rad (m)", "none", "instead: a measured table"),
       list("force", "N m (N)", "none", "its other column")},
      read_spring};
}

}  // namespace porthos::scene
