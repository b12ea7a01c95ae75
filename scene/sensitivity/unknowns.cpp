#include "scene/sensitivity/unknowns.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "mechanics/log_cholesky.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/key_unit.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

using mechanics::LogCholesky;
using mechanics::MassProperties;

constexpr int ten = std::size(inertial_numbers);

double& number_of_body(MassProperties& b, int i) {
  auto& I = b.inertia;
  double* const all[] = {&b.mass, &b.com.x, &b.com.y, &b.com.z, &I.xx,
                         &I.xy,   &I.xz,    &I.yy,    &I.yz,    &I.zz};
  return *all[i];
}
bool is_positive(int i) { return i == 0 || i == 4 || i == 7 || i == 9; }
double inertia_scale(const MassProperties& b) {
  return (b.inertia.xx + b.inertia.yy + b.inertia.zz) / 3;
}
double length_scale(const MassProperties& b) { return std::sqrt(inertia_scale(b) / b.mass); }

Unknown unknown_of(const std::string& body, MassProperties b, int i) {
  const double scale = i == 0 ? b.mass : i < 4 ? length_scale(b) : inertia_scale(b);
  return {body + "." + inertial_numbers[i],
          i == 0  ? "kg"
          : i < 4 ? "m"
                  : "kg m^2",
          number_of_body(b, i), scale};
}

/// The mass properties of a body along its own axes. Null for a name that is none.
std::optional<MassProperties> body_of(const Assembly& a, const std::string& name) {
  for (const auto& b : a.parts.bodies()) {
    if (b.name != name) continue;
    MassProperties m = b.mass;
    m.inertia = mechanics::rotated(m.axes, m.inertia);
    m.axes = mechanics::Mat3<double>::identity();
    return m;
  }
  return {};
}

/// "body[0].linear_velocity[2]"
bool is_start_of_body(const std::string& key) {
  constexpr const char* starts[] = {"].position", "].attitude", "].linear_velocity",
                                    "].angular_velocity"};
  return key.starts_with("body[") && std::ranges::any_of(starts, [&](const char* start) {
           return key.find(start) != key.npos;
         });
}

}  // namespace

Unknowns::Unknowns(const Scene& scene, const Assembly& a, const std::vector<std::string>& names,
                   NumbersOf of)
    : scene_(scene), of_(of) {
  if (names.empty())
    throw InvalidArgument(in_file(scene.path) +
                          "no parameters are named, expected names such as \"link_6\", "
                          "\"link_6.mass\" or \"element[0].stiffness\"");
  for (const auto& name : names)
    if (!add_of_body(name, a) && !add_of_joint(name, a) && !add_of_part(name, a))
      add_key(name, name, a);
  for (size_t i = 0; i < list_.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (list_[i].name == list_[k].name)
        throw InvalidArgument(in_file(scene.path) + "the parameter '" + list_[i].name +
                              "' is asked for twice, expected it once");
}

void Unknowns::add(Unknown unknown, bool positive) {
  if (positive && !(unknown.start > 0))
    throw InvalidArgument(fmt::format(
        "{}the parameter '{}' starts at {}, expected more than 0: it is found by its logarithm",
        in_file(scene_.path), unknown.name, unknown.start));
  start_.push_back(positive ? std::log(unknown.start) : unknown.start / unknown.scale);
  logarithmic_.push_back(positive);
  list_.push_back(std::move(unknown));
}

Unknowns::Body& Unknowns::body(const std::string& name, const MassProperties& mass) {
  const auto at = std::ranges::find(bodies_, name, &Body::name);
  if (at != bodies_.end()) return *at;
  bodies_.push_back({name, mass});
  return bodies_.back();
}

bool Unknowns::add_of_body(const std::string& name, const Assembly& a) {
  auto refuse_body = [&](const std::string& why) {
    throw InvalidArgument(in_file(scene_.path) + "the parameters of '" + name + "': " + why);
  };
  const auto check = [&](const MassProperties& m) {
    if (!(m.mass > 0 && inertia_scale(m) > 0))
      refuse_body("the body has no mass or no inertia to start from, expected both");
  };
  if (const auto mass = body_of(a, name)) {
    check(*mass);
    body(name, *mass).whole = int(list_.size());
    LogCholesky z;
    try {
      z = mechanics::log_cholesky(*mass);
    } catch (const InvalidArgument& e) {
      refuse_body(std::string(e.what()) + "; or name some of its numbers, \"" + name + ".mass\"");
    }
    for (int i = 0; i < ten; ++i) {
      list_.push_back(unknown_of(name, *mass, i));
      logarithmic_.push_back(0);
      start_.push_back(z[size_t(i)] / (i < 4 ? 1 : length_scale(*mass)));
    }
    return true;
  }
  for (int i = 0; i < ten; ++i) {
    const std::string end = std::string(".") + inertial_numbers[i];
    if (!name.ends_with(end)) continue;
    const std::string own = name.substr(0, name.size() - end.size());
    const auto mass = body_of(a, own);
    if (!mass) continue;
    check(*mass);
    body(own, *mass).some.push_back({list_.size(), i});
    add(unknown_of(own, *mass, i), is_positive(i));
    return true;
  }
  return false;
}

bool Unknowns::add_of_joint(const std::string& name, const Assembly& a) {
  for (const auto& c : a.mechanism->coordinates()) {
    if (c.nv != 1) continue;
    for (const char* what : {"position", "velocity"}) {
      if (name != c.name + "." + what) continue;
      const auto at = scene_.joints.find(c.name);
      const bool place = what == std::string("position");
      const double start = at == scene_.joints.end() ? 0
                           : place                   ? at->second.position
                                                     : at->second.velocity;
      keys_.push_back({list_.size(), "initial.joints." + name});
      add({name, place ? c.unit : c.rate_unit, start, std::max(std::fabs(start), 0.1), true},
          false);
      return true;
    }
    if (name == c.name + ".damping" || name == c.name + ".stiffness")
      throw InvalidArgument(
          in_file(scene_.path) + "the parameter '" + name +
          "' of the model file cannot be found, expected an [[element]] of the scene at the joint "
          "instead, \"<its name>." +
          name.substr(c.name.size() + 1) + "\"");
  }
  return false;
}

bool Unknowns::add_of_part(const std::string& name, const Assembly& a) {
  const auto add_of = [&](const char* table, const auto& parts) {
    for (size_t i = 0; i < parts.size(); ++i) {
      const std::string& part = parts[i].name;
      if (part.empty() || !name.starts_with(part + ".")) continue;
      add_key(name, fmt::format("{}[{}]{}", table, i, name.substr(part.size())), a);
      return true;
    }
    return false;
  };
  return add_of("element", scene_.elements) || add_of("body", scene_.bodies) ||
         add_of("contact", scene_.contacts) || add_of("actuator", scene_.actuators) ||
         (of_ == NumbersOf::run && add_of("controller", scene_.controllers));
}

void Unknowns::add_key(const std::string& name, const std::string& key, const Assembly& a) {
  static const Names of_field = {"initial", "environment", "model",   "element",
                                 "body",    "contact",     "actuator"},
                     of_run = {"initial",    "environment", "model",    "element",
                               "body",       "contact",     "actuator", "orbit",
                               "controller", "event",       "stop",     "output"};
  const Names& first = of_ == NumbersOf::run ? of_run : of_field;
  const std::string table = key.substr(0, key.find_first_of(".["));
  std::vector<std::string> known;
  for (const Element& e : scene_.elements) known.push_back(e.name);
  if (std::ranges::find(first, table) == first.end())
    throw InvalidArgument(fmt::format(
        "{}there is no parameter '{}', expected a body or its number (\"link_6\", "
        "\"link_6.mass\"), a number of an element by its name (\"spring.stiffness\"), a start "
        "value (\"joint_1.velocity\") or a key of {}{}",
        in_file(scene_.path), name, joined(first),
        known.empty() ? ""
                      : "; the elements are " + listed(known, [](const auto& n) { return n; })));
  const toml::table root = parse_toml(scene_.text, File{scene_.path});
  const auto value = number_at(root, key);
  if (!value)
    throw InvalidArgument(fmt::format(
        "{}the parameter '{}' is no number of the scene, expected one that it states, to start "
        "from",
        in_file(scene_.path), name));
  // Whether it may be negative, the reader knows.
  bool positive = false;
  if (*value >= 0 && table != "initial") {
    try {
      const Replacement negative{key, {-std::max(*value, 1.0)}};
      (void)with_keys({&negative, 1});
    } catch (const InvalidArgument&) {
      positive = true;
    }
  }
  keys_.push_back({list_.size(), key});
  add({name, unit_of_key(scene_, key, a), *value, *value != 0 ? std::fabs(*value) : 1.0,
       is_of_start(key) || is_start_of_body(key)},
      positive);
}

double Unknowns::value(size_t i, double z) const {
  return logarithmic_[i] ? std::exp(z) : z * list_[i].scale;
}

MassProperties Unknowns::mass_at(const Body& b, std::span<const double> z) const {
  if (b.whole < 0) {
    MassProperties m = b.start;
    for (const auto& [at, i] : b.some) number_of_body(m, i) = value(at, z[at]);
    return m;
  }
  LogCholesky n;
  for (size_t i = 0; i < n.size(); ++i)
    n[i] = z[size_t(b.whole) + i] * (i < 4 ? 1 : length_scale(b.start));
  return mechanics::from_log_cholesky(n);
}

std::vector<double> Unknowns::values(std::span<const double> z) const {
  std::vector<double> all(z.size());
  for (size_t i = 0; i < z.size(); ++i) all[i] = value(i, z[i]);
  for (const Body& b : bodies_) {
    if (b.whole < 0) continue;
    MassProperties m = mass_at(b, z);
    for (int i = 0; i < ten; ++i) all[size_t(b.whole + i)] = number_of_body(m, i);
  }
  return all;
}

std::vector<Replacement> Unknowns::replacements(std::span<const double> z) const {
  std::vector<Replacement> all;
  for (const Key& k : keys_) all.push_back({k.key, {value(k.at, z[k.at])}});
  return all;
}

Scene Unknowns::with_keys(std::span<const Replacement> replaced) const {
  if (replaced.empty()) return scene_;
  Scene s = read_variation(scene_, replaced);
  s.method = scene_.method;
  s.step = scene_.step;
  s.duration = scene_.duration;
  return s;
}

Scene Unknowns::at(std::span<const double> z) const {
  Scene s = with_keys(replacements(z));
  for (size_t b = 0; b < bodies_.size(); ++b) s = with_mass(std::move(s), b, mass(b, z));
  return s;
}

Scene Unknowns::with_mass(Scene s, size_t body, const MassProperties& mass) const {
  const std::string& name = bodies_[body].name;
  if (const auto own = std::ranges::find(s.bodies, name, &FreeBody::name); own != s.bodies.end()) {
    own->mass = mass;
    return s;
  }
  s.urdf.link_inertia[name] = mass;
  s.urdf.replaced_inertia.insert(name);
  s.mass_factor.erase(name);  // which is in its numbers
  return s;
}

std::string Unknowns::text(std::span<const double> z) const {
  toml::table root = parse_toml(scene_.text, File{scene_.path});
  for (const Replacement& r : replacements(z)) replace(root, r.key, r.values);
  for (const Body& b : bodies_) {
    const MassProperties m = mass_at(b, z);
    const auto& I = m.inertia;
    toml::table found{{"mass", m.mass},
                      {"com", toml::array{m.com.x, m.com.y, m.com.z}},
                      {"inertia", toml::array{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}}};
    const auto own = std::ranges::find(scene_.bodies, b.name, &FreeBody::name);
    if (own != scene_.bodies.end()) {
      auto& table = *root["body"][size_t(own - scene_.bodies.begin())].as_table();
      for (auto&& [key, node] : found) table.insert_or_assign(key, node);
      continue;
    }
    found.insert("instead", true);
    auto& model = *root["model"].as_table();
    if (auto* factors = model["mass_factor"].as_table()) factors->erase(b.name);
    auto& inertia = *model.insert("inertia", toml::table{}).first->second.as_table();
    inertia.insert_or_assign(b.name, found);
  }
  std::ostringstream text;
  text << root << "\n";
  return text.str();
}

}  // namespace porthos::scene
