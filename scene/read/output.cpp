#include "scene/read/output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "scene/read/formula.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

struct QuantityInfo {
  OutputQuantity quantity;
  const char* word;
  size_t size;
  const char *unit, *what;
  keys::Keys own;
};

keys::Keys one_key(const char* name, const char* what) {
  return {keys::text(name, keys::required, what)};
}

keys::Keys joint_key() { return one_key("joint", "as porthos info names it"); }
keys::Keys actuator_key() { return one_key("actuator", "the name of one"); }
keys::Keys contact_key() { return one_key("contact", "the name of a soft one"); }

keys::Keys motor_keys() {
  return keys::joined(actuator_key(), {keys::word("motor", {"theta", "sigma"}, "\"theta\"",
                                                  "of the equilibrium, or of the stiffness")});
}

keys::Keys frame_keys(const char* axes) {
  using namespace keys;
  return {text("link", required, "of the model, or a [[body]]"),
          text("relative_to", "\"world\"", axes)};
}
keys::Keys point_keys(const char* axes) {
  using namespace keys;
  return joined(frame_keys(axes),
                {numbers("at", 3, "m", "[0, 0, 0]", "the point, in the link's frame"),
                 numbers("relative_at", 3, "m", "[0, 0, 0]", "a point of relative_to")});
}

SchemaKey axes_key() {
  return keys::word("axes", {"relative_to", "link"}, "\"relative_to\"",
                    "in which it is stated; \"link\": its own, as a gyro has them");
}

/// What soft contacts do.
std::vector<QuantityInfo> quantities_of_contacts() {
  return {{OutputQuantity::contact_force, "contact_force", 3, "N",
           "Of a soft contact, friction included, on its `links`.", contact_key()},
          {OutputQuantity::normal_force, "normal_force", 1, "N",
           "Of a soft contact: the sum of the normal forces of its points.", contact_key()},
          {OutputQuantity::overlap, "overlap", 1, "m",
           "Of a soft contact: how deep its shapes are in each other, 0 where they are apart.",
           contact_key()}};
}

keys::Keys told_keys(const char* of, const char* what) {
  return keys::joined(one_key("controller", "the name of one"), one_key(of, what));
}

/// What whole-body controllers tell, the last two with a gait.
std::vector<QuantityInfo> quantities_of_controllers() {
  return {{OutputQuantity::task_error, "task_error", 1, "m/s^2",
           "Of a whole-body controller: by how much a task's acceleration is missed.",
           told_keys("task", "its name")},
          {OutputQuantity::planned_force, "planned_force", 3, "N",
           "Of a whole-body controller: the force that it expects at a contact, in the world.",
           told_keys("contact", "its name")},
          {OutputQuantity::planned_footstep, "planned_footstep", 3, "m",
           "Of a whole-body controller with a gait: where a foot will land, or stands.",
           told_keys("contact", "the foot")},
          {OutputQuantity::capture_point, "capture_point", 3, "m",
           "Of a whole-body controller with a gait: x + x'/ω of the centre of mass, on the ground.",
           one_key("controller", "the name of one")}};
}

keys::Keys of_links_keys() {
  return {keys::text("link", "all bodies", "of the model, or a [[body]]"),
          {"links", keys::KeyKind::texts, "", "all bodies", "several, as one"}};
}

std::vector<QuantityInfo> quantities_of_links() {
  using namespace keys;
  static const char* axes = "a link, in whose axes it is stated";
  return {{OutputQuantity::position, "position", 3, "m", "Where a point is.", point_keys(axes)},
          {OutputQuantity::attitude, "attitude", 4, "1", "A quaternion (w, x, y, z), w 0 or more.",
           frame_keys(axes)},
          {OutputQuantity::euler_angles, "euler_angles", 3, "rad",
           "The angles about x, y and z of which the attitude is made, one turn after the other.",
           joined(frame_keys(axes),
                  {word("sequence", {"zyx", "xyz", "yzx", "zxy", "xzy", "yxz"}, "\"zyx\"",
                        "of turns about moving axes; zyx: yaw, pitch, roll")})},
          {OutputQuantity::angle, "angle", 1, "rad", "By how much two frames are turned, 0 to π.",
           frame_keys("a link")},
          {OutputQuantity::velocity, "velocity", 3, "m/s", "Of a point, as seen from relative_to.",
           joined(point_keys("a link"), {axes_key()})},
          {OutputQuantity::angular_velocity, "angular_velocity", 3, "rad/s", "Against relative_to.",
           joined(frame_keys("a link"), {axes_key()})},
          {OutputQuantity::distance, "distance", 1, "m", "Of two points, or of spheres round them.",
           joined(point_keys("a link"), {number("radius", "m", "0", "of a sphere round the point"),
                                         number("relative_radius", "m", "0", "likewise")})}};
}

std::vector<QuantityInfo> quantities_of_joints_and_all() {
  using namespace keys;
  return {
      {OutputQuantity::joint_position, "joint_position", 1, "", "With all its turns.", joint_key()},
      {OutputQuantity::joint_rate, "joint_rate", 1, "", "Of one degree of freedom of a joint.",
       joint_key()},
      {OutputQuantity::joint_torque, "joint_torque", 1, "",
       "What elements, actuators, controllers and contacts exert at a joint.", joint_key()},
      {OutputQuantity::joint_wrench,
       "joint_wrench",
       6,
       "N m, N",
       "Moment and force that a joint transmits to its child, about and along its frame.",
       {text("joint", required, "a joint of the model file that moves")}},
      {OutputQuantity::centre_of_mass, "centre_of_mass", 3, "m", "Of all moving bodies.", {}},
      {OutputQuantity::momentum, "momentum", 3, "kg m/s",
       "Of a link with all fixed to it, of several, or of all.", of_links_keys()},
      {OutputQuantity::angular_momentum, "angular_momentum", 3, "kg m^2/s",
       "Likewise, about their centre of mass or that of all.",
       joined(of_links_keys(), {word("about", {"own", "all"}, "\"own\"",
                                     "own: their centre of mass; all: that of all bodies, "
                                     "with velocities against it")})},
      {OutputQuantity::energy, "energy", 1, "J", "In a storage of the ledger.",
       one_key("row", "its name there: kinetic, potential, ...")},
      {OutputQuantity::power, "power", 1, "W", "Of a source or a loss of the ledger.",
       one_key("row", "its name there")}};
}

std::vector<QuantityInfo> quantities_of_actuators() {
  using namespace keys;
  return {
      {OutputQuantity::deflection, "deflection", 1, "rad",
       "Of the spring of an actuator: the joint's angle less the equilibrium, phi = q - theta.",
       actuator_key()},
      {OutputQuantity::stiffness_setting, "stiffness_setting", 1, "",
       "What sets the stiffness of an actuator, sigma.", actuator_key()},
      {OutputQuantity::stiffness, "stiffness", 1, "N m/rad",
       "Of the spring of an actuator, the second derivative of its energy by q.", actuator_key()},
      {OutputQuantity::spring_torque, "spring_torque", 1, "N m",
       "What the spring of an actuator exerts on the link, less the derivative of its energy.",
       actuator_key()},
      {OutputQuantity::motor_rate, "motor_rate", 1, "",
       "Of a motor of an actuator, at its gear's output.", motor_keys()},
      {OutputQuantity::motor_torque, "motor_torque", 1, "",
       "What a motor of an actuator exerts at its gear's output, before friction; a worm gear or "
       "servo: what it holds.",
       motor_keys()}};
}

std::vector<QuantityInfo> quantities_of_orbits_and_formulas() {
  using namespace keys;
  const auto orbital = [](OutputQuantity q, const char* name, const char* unit, const char* what) {
    return QuantityInfo{q, name, 1, unit, what, {}};
  };
  using Q = OutputQuantity;
  const std::vector<SchemaKey> own{text("formula", required, "as \"sqrt(tip.x^2 + tip.y^2)\""),
                                   text("unit", "\"1\"", "for tables and axes")};
  const char* const osculating = "Of the osculating orbit; the node is the ascending one.";
  return {orbital(Q::altitude, "altitude", "m",
                  "In orbit: of the centre of mass, above the sphere of the planet's equator."),
          orbital(Q::semi_major_axis, "semi_major_axis", "m", osculating),
          orbital(Q::eccentricity, "eccentricity", "1", osculating),
          orbital(Q::inclination, "inclination", "rad", osculating),
          orbital(Q::node, "node", "rad", osculating),
          {Q::formula, "formula", 1, "1", "Of outputs before it.", own}};
}

/// Every quantity of an [[output]], in the order of docs/scene_reference.md: the formula last.
const std::vector<QuantityInfo>& quantities() {
  static const std::vector<QuantityInfo> all = [] {
    auto list = quantities_of_links();
    for (const auto& more : {quantities_of_joints_and_all(), quantities_of_actuators(),
                             quantities_of_orbits_and_formulas()})
      list.insert(list.end(), more.begin(), more.end());
    for (const auto& more : {quantities_of_contacts(), quantities_of_controllers()})
      list.insert(list.end() - 1, more.begin(), more.end());
    return list;
  }();
  return all;
}

const QuantityInfo& info_of(OutputQuantity q) {
  return *std::find_if(quantities().begin(), quantities().end(),
                       [&](const QuantityInfo& k) { return k.quantity == q; });
}

/// A name that a formula can use.
void require_name(const Table& t, const std::string& name) {
  const auto fits = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ||
      !std::all_of(name.begin(), name.end(), fits))
    t.fail("name",
           fmt::format("is \"{}\", expected letters, digits and '_', not first a digit", name));
}

LinkPoint read_point(const Table& t, const char* link, const char* at, const char* radius) {
  LinkPoint p;
  if (t.has(link)) p.link = t.text(link, "the name of a link");
  if (t.has(at)) p.at = t.vector(at);
  if (t.has(radius)) p.radius = t.not_negative(radius);
  return p;
}

Output read_output(const Table& t, const QuantityInfo& k, const std::vector<std::string>& known) {
  Output o;
  o.quantity = k.quantity;
  o.where = t.where();
  o.name = t.text("name", "a name");
  require_name(t, o.name);
  o.unit = k.unit;
  o.of = read_point(t, "link", "at", "radius");
  o.seen_from = read_point(t, "relative_to", "relative_at", "relative_radius");
  const auto has_key = [&](const char* key) {
    return std::ranges::find(k.own, key, &SchemaKey::name) != k.own.end();
  };
  const bool of_frame = has_key("relative_to");
  if (of_frame) t.require("link", "the name of a link");
  if (has_key("axes")) {
    o.own_axes = t.choice("axes") == "link";
    if (t.has("relative_to") && o.seen_from.link == o.of.link)
      t.fail("relative_to",
             fmt::format("is '{}', the link itself, against which it does not move, expected "
                         "another; rates about its own axes are axes = \"link\"",
                         o.of.link));
  }
  if (has_key("motor")) o.number = t.choice("motor");
  for (const char* key : {"joint", "row", "actuator", "controller", "contact"})
    if (has_key(key) && o.of_what.empty()) o.of_what = t.text(key, "a name");
  if (has_key("task")) o.number = "error " + t.text("task", "a name");
  if (o.quantity == OutputQuantity::capture_point) o.number = "capture point";
  if (has_key("contact") && o.of_controller())
    o.number = (o.quantity == OutputQuantity::planned_force ? "force " : "footstep ") +
               t.text("contact", "a name");
  if (!of_frame && t.has("link")) o.links = {o.of.link};
  if (t.has("links")) {
    if (t.has("link")) t.fail("links", "is given besides link, expected one of both");
    o.links = t.texts("links", "names of links");
    if (o.links.empty()) t.fail("links", "is empty, expected names of links");
  }
  if (has_key("about")) o.about_all = t.choice("about") == "all";
  if (k.quantity == OutputQuantity::euler_angles) o.sequence = t.choice("sequence");
  if (k.quantity != OutputQuantity::formula) return o;
  o.formula = t.text("formula", "a formula");
  if (t.has("unit")) o.unit = t.text("unit", "a unit");
  try {
    (void)Formula(o.formula, known);
  } catch (const InvalidArgument& e) {
    t.fail("formula", e.what());
  }
  return o;
}

}  // namespace

void refuse_output(const Output& o, const std::string& why) {
  throw InvalidArgument(fmt::format("{}: output '{}': {}", o.where, o.name, why));
}

size_t Output::size() const { return info_of(quantity).size; }

bool Output::needs_field() const {
  return quantity == OutputQuantity::joint_torque || quantity == OutputQuantity::joint_wrench ||
         quantity == OutputQuantity::power || of_motor() || of_controller();
}

std::vector<std::string> component_suffixes(size_t n) {
  if (n == 3) return {"x", "y", "z"};
  if (n == 4) return {"w", "x", "y", "z"};
  if (n == 6) return {"mx", "my", "mz", "fx", "fy", "fz"};
  return {};
}

std::vector<std::string> component_names(const Output& o) {
  if (o.size() == 1) return {o.name};
  auto names = component_suffixes(o.size());
  for (auto& name : names) name = o.name + "." + name;
  return names;
}

std::vector<std::string> number_names(const std::vector<Output>& outputs) {
  std::vector<std::string> names;
  for (const Output& o : outputs)
    for (auto& name : component_names(o)) names.push_back(std::move(name));
  return names;
}

std::vector<Output> needed_for(const std::string& number, const std::vector<Output>& outputs) {
  std::set<std::string> wanted{number};
  std::vector<Output> needed;
  const auto known = number_names(outputs);
  for (auto o = outputs.rbegin(); o != outputs.rend(); ++o) {  // a formula uses those before it
    const auto own = component_names(*o);
    if (std::none_of(own.begin(), own.end(), [&](auto& name) { return wanted.contains(name); }))
      continue;
    if (o->quantity == OutputQuantity::formula) {
      const Formula formula(o->formula, known);
      for (const auto& name : known)
        if (formula.uses(name)) wanted.insert(name);
    }
    needed.insert(needed.begin(), *o);
  }
  return needed;
}

std::vector<Output> read_outputs(const Table& scene) {
  std::vector<Output> list;
  scene.each_of("output", "quantity", [&](const std::string& word, const Table& t) {
    const auto& k = *std::find_if(quantities().begin(), quantities().end(),
                                  [&](const QuantityInfo& q) { return q.word == word; });
    Output o = read_output(t, k, number_names(list));
    for (const Output& other : list)
      if (other.name == o.name)
        t.fail("name",
               fmt::format("\"{}\" is that of another output, expected one of its own", o.name));
    list.push_back(std::move(o));
  });
  return list;
}

std::vector<SchemaTable> output_tables() {
  using namespace keys;
  std::vector<SchemaTable> all;
  for (const QuantityInfo& k : quantities())
    all.push_back({fmt::format("output.{}", k.word),
                   fmt::format("[[output]] quantity = \"{}\"", k.word), k.what,
                   joined({word("quantity", {k.word}, required, "what is computed"),
                           text("name", required, "of its series; letters, digits and _")},
                          k.own)});
  all.push_back(stop_table());
  return all;
}

}  // namespace porthos::scene
