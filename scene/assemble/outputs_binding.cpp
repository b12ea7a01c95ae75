#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "scene/assemble/contacts.h"
#include "scene/assemble/outputs.h"
#include "scene/read/joint_place.h"

/// What the names of an output stand for in a mechanism.
namespace porthos::scene {
namespace {

bool of_links(OutputQuantity q) { return q <= OutputQuantity::distance; }

std::string unit_of(const Output& o, const vsa::ElasticTraits& traits) {
  const bool of_sigma = o.number == "sigma";
  switch (o.quantity) {
    case OutputQuantity::motor_rate:
      return of_sigma ? traits.sigma_rate_unit() : "rad/s";
    case OutputQuantity::motor_torque:
      return of_sigma ? traits.sigma_effort_unit() : "N m";
    default:
      return traits.sigma_unit;
  }
}

/// The unit of an output; that of a joint depends on the mechanism, that of σ on the actuator.
std::string unit_of(const Output& o, const Scene& scene, const Assembly& a) {
  if (o.of_actuator() && o.unit.empty())
    for (const JointActuator& j : scene.actuators)
      if (j.name == o.of_what) return unit_of(o, j.actuator.elastic->traits());
  if (!o.unit.empty() || !a.mechanism) return o.unit;
  for (const auto& f : freedoms_of(*a.mechanism))
    if (f.name == o.of_what)
      return o.quantity == OutputQuantity::joint_position ? f.of->unit
             : o.quantity == OutputQuantity::joint_rate   ? f.of->rate_unit
                                                          : f.of->effort_unit;
  return "";
}

}  // namespace

std::vector<OutputColumn> output_columns(const Scene& scene, const Assembly& assembly) {
  std::vector<OutputColumn> all;
  for (const Output& o : scene.outputs)
    all.push_back({o.name, unit_of(o, scene, assembly), o.size()});
  return all;
}

std::string unit_of_number(const std::string& unit, const std::string& name) {
  const size_t comma = unit.find(", "), dot = name.rfind('.');
  if (comma == unit.npos) return unit;
  return name[dot == name.npos ? 0 : dot + 1] == 'm' ? unit.substr(0, comma)
                                                     : unit.substr(comma + 2);
}

std::vector<std::string> number_units(const Scene& scene, const Assembly& assembly) {
  std::vector<std::string> all;
  for (const Output& o : scene.outputs)
    for (const auto& name : component_names(o))
      all.push_back(unit_of_number(unit_of(o, scene, assembly), name));
  return all;
}

PlaceOnLink place_on_link(const mechanics::Mechanism& m, const LinkPoint& p,
                          const std::string& where) {
  const mechanics::Pose point{mechanics::Mat3<double>::identity(), p.at};
  if (p.link == "world") return {-1, point};
  try {
    const auto& body = m.body(p.link);
    return {body.node, body.pose * point};
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(where + ": " + e.what());
  }
}

void Outputs::bind(Item& item) {
  const Output& o = *item.output;
  if (!assembly_.mechanism) refuse_output(o, "the system has no mechanism, expected a model file");
  if (of_links(o.quantity)) {
    item.of = place_on_link(*assembly_.mechanism, o.of, o.where);
    item.seen_from = place_on_link(*assembly_.mechanism, o.seen_from, o.where);
  }
  if (o.of_joint()) bind_joint(item);
  if (o.quantity == OutputQuantity::energy || o.quantity == OutputQuantity::power) bind_row(item);
  if (o.of_actuator()) bind_actuator(item);
  if (o.of_contact()) bind_contact(item);
  if (o.of_controller()) bind_told(item);
  if (o.of_orbit() && !scene_.orbit) refuse_output(o, "the scene has no [orbit], expected one");
  for (const auto& link : o.links) {
    const int node = place_on_link(*assembly_.mechanism, {link, {}, 0}, o.where).node;
    if (node < 0) refuse_output(o, "link '" + link + "' does not move");
    if (std::ranges::count(item.nodes, size_t(node)) == 0) item.nodes.push_back(size_t(node));
  }
}

void Outputs::bind_joint(Item& item) {
  const Output& o = *item.output;
  if (o.quantity == OutputQuantity::joint_wrench) {
    refuse_wrench(o);
    for (const auto& c : assembly_.mechanism->coordinates())
      if (c.joint == o.of_what) item.node = c.node;
    for (const auto& b : assembly_.parts.bodies())  // the frame of the joint is its child's
      if (b.joint.name == o.of_what && item.node >= 0) {
        item.of = place_on_link(*assembly_.mechanism, {b.joint.turned ? b.parent : b.name, {}, 0},
                                o.where);
        item.turned = b.joint.turned;
      }
    item.gone = item.node < 0 && assembly_.is_phase;
    if (item.node < 0 && !item.gone)
      refuse_output(o, "the model has no joint '" + o.of_what + "' that moves");
    return;
  }
  for (const Element& e : scene_.elements)
    if (o.quantity == OutputQuantity::joint_torque && e.dry && e.joint == o.of_what)
      refuse_output(o, "joint_torque does not know what dry friction '" + e.name +
                           "' holds, expected another joint, or quantity = \"power\" of it");
  std::string own;
  for (const auto& f : freedoms_of(*assembly_.mechanism)) {
    const auto& c = *f.of;
    const bool has_it = f.has_coordinate() || o.quantity != OutputQuantity::joint_position;
    if ((c.joint == o.of_what || c.name == o.of_what) && has_it) add_to_list(own, f.name);
    if (f.name != o.of_what) continue;
    if (!has_it)
      refuse_output(o, "'" + f.name +
                           "' is a rate without a coordinate, expected quantity = "
                           "\"attitude\", \"angle\" or \"position\" of its link");
    item.q = c.q;
    item.v = f.v;
    item.node = c.node;
    item.turn = f.has_coordinate() ? assembly_.mechanism->nodes()[size_t(c.node)].turn : -1;
    item.whole = !f.has_coordinate();
    return;
  }
  if (!own.empty())
    refuse_output(
        o, "joint '" + o.of_what + "' has several degrees of freedom, expected one of: " + own);
  for (const auto& c : assembly_.mechanism->coordinates())
    if (c.name == o.of_what || c.joint == o.of_what)
      refuse_output(o, "joint '" + o.of_what +
                           "' turns freely, expected quantity = \"attitude\", "
                           "\"angle\" or \"position\" of its link");
  item.gone = assembly_.is_phase;
  if (item.gone) return;
  try {
    (void)assembly_.mechanism->coordinate(o.of_what);  // names the known ones
  } catch (const InvalidArgument& e) {
    refuse_output(o, e.what());
  }
}

void Outputs::bind_row(Item& item) {
  const Output& o = *item.output;
  const auto& d = assembly_.model->description();
  std::vector<std::string> known = d.storages, others;
  for (const auto& p : d.powers) others.push_back(p.name);
  const bool stored = o.quantity == OutputQuantity::energy;
  if (!stored) known.swap(others);
  const auto at = std::find(known.begin(), known.end(), o.of_what);
  item.row = int(at - known.begin());
  item.gone = at == known.end() && assembly_.is_phase;
  if (at != known.end() || item.gone) return;
  if (std::ranges::count(others, o.of_what) > 0)
    refuse_output(o, fmt::format("'{}' is a row of {}, expected quantity = \"{}\"", o.of_what,
                                 stored ? "work, not of energy that is stored" : "stored energy",
                                 stored ? "power" : "energy"));
  refuse_output(o, fmt::format("the ledger has no row '{}', expected one of: {}", o.of_what,
                               fmt::join(known, ", ")));
}

/// A number that a sampled controller tells.
void Outputs::bind_told(Item& item) {
  const Output& o = *item.output;
  const std::string kind = o.number.substr(0, o.number.find(' ') + 1);
  std::string own, known;
  for (const auto& hold : model_.holds()) {
    for (const phs::Shown& s : hold->shown) {
      const bool of_it = hold->name == o.of_what;
      if (of_it && s.name == o.number) {
        item.told += s.at;
        return;
      }
      if (!s.name.starts_with(kind)) continue;
      if (of_it)
        add_to_list(own, s.name.substr(kind.size()));
      else
        add_to_list(known, fmt::format("{} of '{}'", s.name, hold->name));
    }
    item.told += hold->fresh.size();
  }
  item.gone = assembly_.is_phase;
  if (!own.empty()) known = own;
  if (known.empty()) known = "a whole_body, with a gait for capture points and footsteps";
  if (!item.gone)
    refuse_output(o, fmt::format("there is no {} of a controller '{}', expected {}", o.number,
                                 o.of_what, known));
}

void Outputs::bind_contact(Item& item) {
  const Output& o = *item.output;
  std::vector<std::string> soft;
  for (const SceneContact& c : scene_.contacts) {
    if (!c.law.rigid()) soft.push_back(c.name);
    if (c.name != o.of_what) continue;
    if (c.law.rigid())
      refuse_output(o,
                    fmt::format("contact '{}' is rigid and has impulses, no forces, expected one "
                                "with a soft law",
                                c.name));
    if (o.quantity == OutputQuantity::contact_force &&
        std::ranges::find(c.against, each_other) != c.against.end())
      refuse_output(o, fmt::format("the forces of contact '{}' among its links have the sum 0, "
                                   "expected quantity = \"normal_force\"",
                                   c.name));
  }
  const auto* const model = contacts_in(*assembly_.model);
  const auto& known = model ? model->contacts() : std::vector<contact::Contact>{};
  const auto at = std::ranges::find(known, o.of_what, &contact::Contact::name);
  item.contact = size_t(at - known.begin());
  item.gone = at == known.end() && assembly_.is_phase;
  if (item.gone) return;
  if (at == known.end())
    refuse_output(
        o, fmt::format("there is no soft [[contact]] '{}', expected {}", o.of_what,
                       soft.empty() ? "one" : fmt::format("one of: {}", fmt::join(soft, ", "))));
  if (!contacts_) contacts_.emplace(*model);
}

/// What acts on links that the joint carries, or closes loops, would have to be taken off their
/// momentum.
void Outputs::refuse_wrench(const Output& o) const {
  const auto refuse = [&](const std::string& other) {
    refuse_output(o, "joint_wrench cannot be combined with " + other + ", expected one of both");
  };
  for (const auto* spec : {&scene_.constraints.spec, &scene_.constraints.later}) {
    for (const auto& l : spec->loops) refuse("loop '" + l.name + "'");
    for (const auto& l : spec->rods) refuse("rod '" + l.name + "'");
    for (const auto& l : spec->rollings) refuse("rolling '" + l.name + "'");
  }
  for (const auto& c : scene_.contacts) refuse("contact '" + c.name + "'");
  for (const Element& e : scene_.elements)
    if (e.joint.empty() && !e.torquer)  // rods are on the base, which no joint carries
      refuse(fmt::format("{} '{}', which acts on links", e.type, e.name));
    else if (e.stop && e.stop->law.rigid())
      refuse("the rigid stop '" + e.name + "'");
    else if (e.dry)
      refuse("dry friction '" + e.name + "'");
}

}  // namespace porthos::scene
