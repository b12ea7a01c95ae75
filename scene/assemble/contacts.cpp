#include "scene/assemble/contacts.h"

#include <fmt/format.h>

#include <algorithm>

#include "contact/rigid.h"
#include "contact/soft_touches.h"
#include "contact/sticking.h"
#include "contact/time_stepping.h"
#include "contact/urdf_shapes.h"
#include "integrators/catalogue.h"
#include "integrators/control/switching.h"
#include "phs/network/network.h"

namespace porthos::scene {
namespace {

/// The surfaces of links, or of the world.
std::vector<contact::Surface> surfaces(const Scene& scene, const std::vector<std::string>& links,
                                       const std::optional<contact::Shape>& shape) {
  std::vector<contact::Surface> all;
  for (const auto& link : links) {
    if (shape) {
      all.push_back({link, *shape});
    } else if (link == "world") {
      contact::Shape ground;
      ground.kind = contact::Kind::plane;
      all.push_back({link, ground});
    } else {
      for (const contact::Shape& s : contact::urdf_shapes(scene.urdf_text, scene.urdf_path, link))
        all.push_back({link, s});
    }
  }
  return all;
}

/// 1/R of the one curved surface that Hertz's law takes from a modulus.
double curvature(const contact::Surface& s) {
  if (s.shape.kind == contact::Kind::plane) return 0;
  if (s.shape.kind == contact::Kind::sphere) return 1 / s.shape.radius;
  throw InvalidArgument(
      fmt::format("a modulus is given for a {} on '{}', expected spheres and planes, or a "
                  "stiffness",
                  contact::to_string(s.shape.kind), s.link));
}
double hertz_stiffness(const contact::Contact& c, double modulus) {
  double k = 0;
  for (const contact::Surface& a : c.a)
    for (const contact::Surface& b : c.b) {
      const double own = contact::hertz_stiffness(modulus, curvature(a) + curvature(b));
      if (k > 0 && own != k)
        throw InvalidArgument(
            "its pairs have different radii, expected a [[contact]] for each, or a stiffness");
      k = own;
    }
  return k;
}

contact::Contact contact_of(const SceneContact& from, const Scene& scene) {
  contact::Contact c{from.name, surfaces(scene, from.links, from.shape), {}, from.law};
  for (const auto& link : from.against) {
    const auto more = link == each_other ? c.a : surfaces(scene, {link}, from.against_shape);
    c.b.insert(c.b.end(), more.begin(), more.end());
  }
  if (from.modulus > 0) c.law.stiffness = hertz_stiffness(c, from.modulus);
  return c;
}

contact::Stop stop_of(const Element& e, const mechanics::MechanicalModel& model) {
  contact::Stop s;
  s.name = e.name;
  s.joint = e.joint;
  s.law = e.stop->law;
  auto lower = e.stop->lower, upper = e.stop->upper;
  for (const auto& j : model.mechanism().joint_properties()) {
    if (j.joint != e.joint) continue;
    if (!lower) lower = j.lower;
    if (!upper) upper = j.upper;
  }
  if (!lower && !upper)
    throw InvalidArgument(
        fmt::format("neither the scene nor the model file gives a limit of joint '{}', expected "
                    "lower or upper",
                    e.joint));
  if (lower) s.lower = *lower;
  if (upper) s.upper = *upper;
  return s;
}

template <class F>
auto at_place(const std::string& where, const char* what, const std::string& name, F f) {
  try {
    return f();
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(fmt::format("{}{} '{}': {}", in_file(where), what, name, e.what()));
  }
}

/// What scenes call the mechanism; null in a network that no scene made.
const phs::Model* mechanism_of(const phs::NetworkModel& network) {
  return network.has("mechanism") ? &network.member("mechanism") : nullptr;
}

/// Whether a method of a scene has rigid contacts without events.
bool makes_jumps(const std::string& method) {
  return integrators::knows_method(method) && integrators::declaration_of(method).needs.contacts;
}

}  // namespace

const contact::ContactModel* contacts_in(const phs::Model& model) {
  if (const auto* craft = dynamic_cast<const space::Spacecraft*>(&model))
    return contacts_in(craft->internal());
  if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&model)) {
    const phs::Model* const mechanism = mechanism_of(*network);
    return mechanism ? contacts_in(*mechanism) : nullptr;
  }
  return dynamic_cast<const contact::ContactModel*>(&model);
}

std::shared_ptr<const phs::Model> with_contacts(
    std::shared_ptr<const phs::Model> inner,
    const std::shared_ptr<const mechanics::MechanicalModel>& mechanical, const Scene& scene) {
  std::vector<contact::Contact> contacts;
  std::vector<contact::Stop> stops;
  std::vector<contact::DryFriction> dry;
  const auto& constraints = mechanical->description().constraints;
  const auto refuse_rigid = [&](const std::string& where, const std::string& what) {
    if (!constraints.empty())
      throw InvalidArgument(fmt::format(
          "{}{} is rigid and '{}' is a constraint, expected a soft law in a mechanism with any",
          in_file(where), what, constraints.front().name));
  };
  for (const SceneContact& c : scene.contacts) {
    if (c.law.rigid()) refuse_rigid(c.where, "contact '" + c.name + "'");
    if (scene.orbit && std::count(c.against.begin(), c.against.end(), "world") > 0)
      throw InvalidArgument(
          fmt::format("{}: contact '{}' touches the world, expected a link or [[body]] in orbit",
                      c.where, c.name));
    contacts.push_back(at_place(c.where, "contact", c.name, [&] { return contact_of(c, scene); }));
  }
  for (const Element& e : scene.elements)
    if (e.stop && e.stop->law.rigid()) refuse_rigid(e.where, "joint stop '" + e.name + "'");
  for (const Element& e : scene.elements)
    if (e.stop)
      stops.push_back(
          at_place(e.where, "element", e.name, [&] { return stop_of(e, *mechanical); }));
  for (const Element& e : scene.elements) {
    if (!e.dry) continue;
    if (!constraints.empty())
      throw InvalidArgument(fmt::format(
          "{}dry friction '{}' sticks and '{}' is a constraint, expected smooth friction in a "
          "mechanism with any",
          in_file(e.where), e.name, constraints.front().name));
    dry.push_back(*e.dry);
  }
  if (contacts.empty() && stops.empty() && dry.empty()) return inner;
  try {
    auto model = std::make_shared<const contact::ContactModel>(
        inner, mechanical, std::move(contacts), std::move(stops), std::move(dry));
    if (!makes_jumps(scene.method)) model->check_friction_of_events();
    return model;
  } catch (const InvalidArgument& why) {
    const std::string text = why.what();
    for (const SceneContact& c : scene.contacts)
      if (text.starts_with("contact '" + c.name + "'"))
        throw InvalidArgument(in_file(c.where) + text);
    for (const Element& e : scene.elements)
      if (text.starts_with("stop '" + e.name + "'") ||
          text.starts_with("dry friction '" + e.name + "'"))
        throw InvalidArgument(in_file(e.where) + text);
    throw;
  }
}

void check_contacts(const Scene& scene, const phs::Model& model) {
  const auto* const contacts = contacts_in(model);
  if (!contacts) return;
  const auto node = [&](const std::string& link) {
    return link == "world" ? -1 : contacts->mechanism().body(link).node;
  };
  const auto apart = [&](const std::string& a, const std::string& b) {
    return node(a) != node(b) && !contacts->connected(node(a), node(b));
  };
  for (const SceneContact& c : scene.contacts) {
    const auto refuse = [&](const std::string& why) {
      throw InvalidArgument(fmt::format("{}: contact '{}': {}", c.where, c.name, why));
    };
    for (const auto& a : c.links)
      for (const auto& b : c.against)
        if (a == b)
          refuse(
              fmt::format("'{}' is on both sides, expected against = [\"{}\"] for links among "
                          "themselves",
                          a, each_other));
        else if (b != each_other && node(a) == node(b))
          refuse(fmt::format("'{}' and '{}' are one rigid body, expected two that move", a, b));
    if (std::count(c.against.begin(), c.against.end(), each_other) > 0 &&
        std::none_of(c.links.begin(), c.links.end(), [&](const std::string& a) {
          return std::any_of(c.links.begin(), c.links.end(),
                             [&](const std::string& b) { return apart(a, b); });
        }))
      refuse("no two of its links can touch each other, expected two that no joint connects");
  }
}

bool switches(const Scene& s) {
  return std::any_of(s.contacts.begin(), s.contacts.end(),
                     [](const SceneContact& c) { return c.law.switches(); }) ||
         std::any_of(s.elements.begin(), s.elements.end(),
                     [](const Element& e) { return e.dry || (e.stop && e.stop->law.switches()); });
}

bool jumps(const phs::Model& model) {
  const auto* const contacts = contacts_in(model);
  return contacts && (!contacts->rigid().empty() || !contacts->dry().empty());
}

namespace {
/// with_touches() of the contacts, null: none, in a model.
std::unique_ptr<integrators::Integrator> with_those(const contact::ContactModel* contacts,
                                                    const phs::Model& model,
                                                    const std::string& method, double h,
                                                    const integrators::Options& options,
                                                    const MakeMethod& make) {
  if (!contacts) return make(model);
  if (!contacts->rigid().empty() && makes_jumps(method))
    return contact::with_time_stepping(model, *contacts, h, options);
  if (!contacts->rigid().empty()) return contact::with_rigid_contacts(model, *contacts, h, make);
  if (!contacts->dry().empty()) return contact::with_dry_friction(model, *contacts, h, make);
  return integrators::make_switched(make(model), model, h, contacts->depths());
}
}  // namespace

std::unique_ptr<integrators::Integrator> with_touches(const phs::Model& model,
                                                      const std::string& method, double h,
                                                      const integrators::Options& options,
                                                      const MakeMethod& make) {
  return with_those(contacts_in(model), model, method, h, options, make);
}

void check_overlaps(const Scene& scene, const phs::Model& model, const phs::State& start) {
  const auto* const contacts = contacts_in(model);
  if (!contacts) return;
  const auto [name, depth] = contacts->deepest_rigid(start);
  if (!(depth > 1e-9)) return;
  const auto refuse = [&, &named = name, &deep = depth](const std::string& where) {
    throw InvalidArgument(
        fmt::format("{}'{}' is rigid and overlaps by {:.3g} at the start, expected a gap",
                    in_file(where), named, deep));
  };
  for (const SceneContact& c : scene.contacts)
    if (c.name == name) refuse(c.where);
  for (const Element& e : scene.elements)
    if (e.name == name)
      throw InvalidArgument(
          fmt::format("{}joint '{}' starts {:.3g} outside the limits of its rigid stop '{}', "
                      "expected a start inside them",
                      in_file(e.where), e.joint, depth, name));
}

std::vector<mechanics::UrdfNote> notes_on_depths(const Scene& scene, const phs::Model& model,
                                                 const phs::State& start) {
  const auto* const contacts = contacts_in(model);
  if (!contacts || contacts->contacts().empty()) return {};
  contact::SoftTouches touches(*contacts);
  const auto all = touches.at(start);
  std::vector<mechanics::UrdfNote> notes;
  for (size_t k = 0; k < all.size(); ++k) {
    const contact::SoftTouch& at = all[k];
    if (!(at.depth > 0.1 * at.half_size)) continue;
    const std::string& name = contacts->contacts()[k].name;
    for (const SceneContact& c : scene.contacts)
      if (c.name == name)
        notes.push_back({c.where, fmt::format("contact '{}' starts {:.3g} m deep, in a shape of "
                                              "half-size {:.3g} m, and stores {:.4g} J, which "
                                              "will throw its bodies apart: expected a start with "
                                              "a gap, if this is not meant",
                                              name, at.depth, at.half_size, at.energy)});
  }
  return notes;
}

space::SplitOptions split_options(const space::Spacecraft& craft, const std::string& splitting,
                                  const std::string& method, const integrators::Options& options) {
  return {splitting, method, options,
          [&craft, method, options](const phs::Model& of_run, double h) {
            return with_those(contacts_in(craft.internal()), of_run, method, h, options,
                              [&](const phs::Model& m) {
                                return integrators::make_integrator(method, m, h, options);
                              });
          }};
}

}  // namespace porthos::scene
