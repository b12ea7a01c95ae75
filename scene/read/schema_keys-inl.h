#pragma once
#include <fmt/format.h>

#include <string>
#include <vector>

#include "scene/read/schema.h"

/// Keys of the tables of a scene, one call each: name, unit, default ("required" if there is none)
/// and a description of one line.
namespace porthos::scene::keys {

using KeyKind = SchemaKey::Kind;
using Keys = std::vector<SchemaKey>;

inline const std::string required = "required";

inline SchemaKey number(const char* name, const char* unit, const std::string& otherwise,
                        const char* what) {
  return {name, KeyKind::number, unit, otherwise, what};
}
inline SchemaKey whole(const char* name, const std::string& otherwise, const char* what) {
  return {name, KeyKind::whole, "", otherwise, what};
}
inline SchemaKey text(const char* name, const std::string& otherwise, const char* what) {
  return {name, KeyKind::text, "", otherwise, what};
}
inline SchemaKey yes_or_no(const char* name, const std::string& otherwise, const char* what) {
  return {name, KeyKind::boolean, "", otherwise, what};
}
inline SchemaKey word(const char* name, std::vector<std::string> words,
                      const std::string& otherwise, const char* what) {
  return {name, KeyKind::word, "", otherwise, what, std::move(words)};
}
inline SchemaKey numbers(const char* name, int count, const char* unit,
                         const std::string& otherwise, const char* what) {
  return {name, KeyKind::numbers, unit, otherwise, what, {}, count};
}
inline SchemaKey rows(const char* name, int count, const char* unit, const std::string& otherwise,
                      const char* what) {
  return {name, KeyKind::rows, unit, otherwise, what, {}, count};
}
inline SchemaKey list(const char* name, const char* unit, const std::string& otherwise,
                      const char* what) {
  return {name, KeyKind::list, unit, otherwise, what};
}
inline SchemaKey table(const char* name, const char* id, const std::string& otherwise,
                       const char* what, KeyKind kind = KeyKind::table) {
  return {name, kind, "", otherwise, what, {}, 0, id};
}
inline SchemaKey signal_table(const char* name, const std::string& otherwise, const char* what) {
  return table(name, "signal", otherwise, what);
}

inline Keys joined(Keys a, const Keys& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// One number for all three axes, or three.
inline SchemaKey axes(const char* name, const char* unit, const char* what) {
  return {name, KeyKind::axes, unit, "0", what, {}, 3};
}

/// Keys of the law of a contact, see read_law(); the units of its numbers. stated: the default of
/// the stiffness.
inline Keys law_keys(std::vector<std::string> laws, const char* stiffness,
                     const std::string& stated, const char* width, const char* loss,
                     const char* speed) {
  return {
      word("law", std::move(laws), "\"smooth\"", "how the force grows with the depth"),
      number("stiffness", stiffness, stated, "more than 0"),
      whole("exponent", "1", "of law = \"power\": 1, 2 or 3"),
      number("width", width, "required by smooth", "of the rounded corner of the force"),
      number("loss", loss, "0", "a in force · (1 + a · rate of the depth)"),
      number("restitution", "1", "by loss",
             "instead of loss: of an impact at speed; of rigid: of "
             "every impact, 0 to 1"),
      number("speed", speed, "with restitution", "at which the restitution holds; not of rigid"),
      word("simultaneous", {"reflections", "moreau"}, "\"reflections\"",
           "of rigid: what several contacts do that touch at one instant")};
}

/// Keys of a signal in time, see read_signal().
inline Keys signal_keys(const char* unit) {
  return {
      number("constant", unit, "one of the four", "always the same"),
      table("sine", "sine", "one of the four", "{ amplitude, frequency, phase, offset }"),
      table("profile", "profile", "one of the four",
            "{ times, values }, a smooth curve through them"),
      table("file", "signal_file", "one of the four", "{ path, time, value }, from a CSV file")};
}

/// Keys of the start of a body or a free base.
inline Keys motion(bool of_body) {
  return {numbers("position", 3, "m", "[0, 0, 0]", "in the world"),
          numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]", "quaternion to the world; normalised"),
          numbers("linear_velocity", 3, "m/s", "[0, 0, 0]",
                  of_body ? "of its origin, in world axes" : "of the base's origin, in world axes"),
          numbers("angular_velocity", 3, "rad/s", "[0, 0, 0]", "body rates, in its own axes")};
}

inline Keys mass(const std::string& inertia) {
  return {number("mass", "kg", required, "0 or more; the inertia does not follow it"),
          numbers("com", 3, "m", "[0, 0, 0]", "centre of mass in its frame"),
          numbers("inertia", 6, "kg m²", inertia,
                  "[ixx, iyy, izz, ixy, ixz, iyz] about the centre of mass")};
}

}  // namespace porthos::scene::keys

namespace porthos::scene {

/// Tables that say what is run and how; a scene may have each of them once.
std::vector<SchemaTable> run_tables();
/// Tables of which a scene may have several, except elements; the tables of the orbit, and tables
/// inside others.
std::vector<SchemaTable> part_tables();

}  // namespace porthos::scene
