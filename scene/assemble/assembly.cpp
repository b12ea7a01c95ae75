#include "scene/assemble/assembly.h"

#include <fmt/format.h>

#include <algorithm>

#include "mechanics/constraints/maximal.h"
#include "scene/assemble/contacts.h"
#include "scene/assemble/detail/start.h"
#include "scene/assemble/law_inputs.h"
#include "scene/assemble/outputs.h"
#include "scene/assemble/parts.h"
#include "scene/assemble/stops.h"
#include "scene/files/hdf5_file.h"
#include "scene/read/variation.h"

namespace porthos::scene {
namespace {

using mechanics::Mechanism;

/// The locked joints of a scene that goes on from a run stay where they were locked there.
/// @throws InvalidArgument for a joint that moves in that run, and for one of which nothing says
///   where it is
void stay_locked(const Scene& scene, mechanics::UrdfOptions& o) {
  const StartFrom& from = *scene.start_from;
  for (const std::string& name : scene.urdf.locked) {
    const auto refuse_lock = [&](const char* why) {
      throw InvalidArgument(
          fmt::format("{}: joint '{}' of [model] lock {}", from.where, name, why));
    };
    if (from.joined.locked.contains(name))
      refuse_lock("is locked by an event of that run, which holds: expected it in one of both");
    if (from.state.contains(link_name(name)))
      refuse_lock(
          "moves in that run: expected an [[event]] of type \"lock\" at 0 in its place, which "
          "stops it and keeps the ledger");
    if (scene.joints.contains(name)) continue;
    if (!from.locked_at.contains(name))
      refuse_lock("is not in that run's record: expected where it is, in [initial] joints");
    for (const auto& [key, values] : from.locked_at)
      if ((key == name || key.starts_with(name + ".")) && !values.empty())
        o.locked_at[key] = values;
  }
}

/// Options for reading the model: locked joints are at their start values.
mechanics::UrdfOptions reading_of(const Scene& scene) {
  mechanics::UrdfOptions o = scene.urdf;
  if (scene.start_from) stay_locked(scene, o);
  for (const auto& [name, start] : scene.joints) {
    if (!is_locked(scene, name)) continue;
    if (!start.motion) {
      if (start.velocity != 0)
        refuse_start(name, start, "the joint is locked, expected no velocity");
      o.locked_at[name] = {start.position};
      continue;
    }
    const BaseStart& m = *start.motion;
    if (mechanics::norm(m.linear_velocity) != 0 || mechanics::norm(m.angular_velocity) != 0)
      refuse_start(name, start, "the joint is locked, expected no velocity");
    o.locked_at[name].assign(m.attitude_wxyz, m.attitude_wxyz + 4);
    if (start.translates)
      o.locked_at[name + ".position"] = {m.position.x, m.position.y, m.position.z};
  }
  return o;
}

/// The error for a massless part that moves, with the remedies that a scene has.
InvalidArgument with_ways_out(const mechanics::MasslessPart& e, const Scene& scene) {
  std::string ways;
  const auto add = [&](const std::string& way) { ways += (ways.empty() ? "" : ", or ") + way; };
  if (!e.joint.empty() && e.joint != mechanics::base_joint_name)
    add(fmt::format("[model] lock = [\"{}\"] holds the joint where it starts", e.joint));
  const bool floats = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  if (e.joint.empty() && floats) add("[model] base = \"fixed\" if it stands in the world");
  if (!e.links.empty()) add(fmt::format("[model.inertia.{}] gives the link mass", e.links.front()));
  if (scene.urdf.links_without_inertia == mechanics::UrdfOptions::NoInertia::error)
    add("[model] links_without_inertia = \"massless\" if links with mass follow");
  return InvalidArgument(e.what() + (ways.empty() ? "" : ": " + ways));
}

/// An error names the part and the line of its element.
std::shared_ptr<const phs::Model> with_parts(
    std::shared_ptr<const mechanics::MechanicalModel> mechanical, const Scene& scene,
    const space::Parts& parts) {
  try {
    return std::make_shared<const space::PartsModel>(std::move(mechanical), parts);
  } catch (const InvalidArgument& why) {
    const std::string text = why.what();
    for (const Element& e : scene.elements)
      if (text.find("'" + e.name) != std::string::npos)
        throw InvalidArgument(in_file(e.where) + text);
    throw;
  }
}

/// An error names the line of the constraint.
std::shared_ptr<const mechanics::MechanicalModel> with_constraints(
    std::shared_ptr<const Mechanism> mechanism, const Scene& scene,
    const std::vector<mechanics::Coupling>& mimics) {
  mechanics::ConstraintSpec spec = scene.constraints.spec;
  spec.couplings.insert(spec.couplings.end(), mimics.begin(), mimics.end());
  try {
    return std::make_shared<const mechanics::MechanicalModel>(
        std::move(mechanism), std::vector<mechanics::BodyPort>(), spec);
  } catch (const InvalidArgument& e) {
    throw scene.constraints.placed(e);
  }
}

mechanics::BodySpec part_of(const FreeBody& b) {
  mechanics::BodySpec part;
  part.name = b.name;
  part.parent = "world";
  part.where = b.where;
  part.joint.type = "free";
  part.joint.name = b.name;
  part.mass = b.mass;
  return part;
}

void scale_masses(mechanics::MechanismBuilder& parts,
                  const std::map<std::string, double>& factors) {
  for (const auto& [link, factor] : factors) {
    auto& all = parts.bodies();
    const auto b =
        std::find_if(all.begin(), all.end(), [&, &l = link](const auto& k) { return k.name == l; });
    if (b == all.end()) {
      const std::string known = listed(all, [](const auto& k) { return k.name; });
      throw InvalidArgument(fmt::format(
          "[model] mass_factor.{}: the model has no link of this name, expected one of: {}", link,
          known));
    }
    auto& i = b->mass.inertia;
    b->mass.mass *= factor;
    for (double* e : {&i.xx, &i.xy, &i.xz, &i.yy, &i.yz, &i.zz}) *e *= factor;
  }
}

}  // namespace

std::shared_ptr<const phs::Model> with_joint_parts(
    std::shared_ptr<const mechanics::MechanicalModel> mechanical, const Scene& scene,
    AddedControllers* added) {
  if (scene.elements.empty() && scene.actuators.empty() && scene.contacts.empty() &&
      scene.controllers.empty())
    return mechanical;
  std::shared_ptr<const phs::Model> body = mechanical;
  if (space::Parts parts = parts_of(scene); parts.any())
    body = with_parts(mechanical, scene, parts);
  body = with_contacts(std::move(body), mechanical, scene);
  if (scene.actuators.empty() && scene.controllers.empty() &&
      std::all_of(scene.elements.begin(), scene.elements.end(),
                  [](const Element& e) { return !e.add; }))
    return body;
  phs::Network n(mechanical->description().name);
  n.add("mechanism", body).main("mechanism");
  add_elements(n, *mechanical, scene.elements);
  for (const JointActuator& a : scene.actuators)
    for (const Element& e : scene.elements)
      if (e.motor && e.joint == a.joint)
        throw InvalidArgument(fmt::format(
            "{}: actuator '{}' and dc_motor '{}' both drive joint '{}', expected one: the motor "
            "behind a spring is [actuator.theta]",
            a.where, a.name, e.name, a.joint));
  add_actuators(n, *mechanical, scene.actuators);
  auto made = add_controllers(n, mechanical, scene, [&](const std::vector<std::string>& names) {
    return law_inputs(scene, mechanical, names);
  });
  if (added) *added = std::move(made);
  return n.build();
}

namespace {
/// The mechanism in maximal coordinates.
struct Maximal {
  mechanics::MechanismBuilder parts;
  std::shared_ptr<const Mechanism> mechanism;
  std::shared_ptr<const mechanics::MechanicalModel> model;
};
Maximal maximal_of(const Scene& scene, const Assembly& a) {
  auto form = mechanics::maximal_form(a.parts, scene.constraints.spec);
  auto mechanism = std::make_shared<const Mechanism>(form.parts.build());
  auto model = std::make_shared<const mechanics::MechanicalModel>(
      mechanism, std::vector<mechanics::BodyPort>(), form.constraints);
  return {std::move(form.parts), std::move(mechanism), std::move(model)};
}
void take_maximal_coordinates(Assembly& a, Maximal m) {
  a.reduced = a.mechanical;
  a.parts = std::move(m.parts);
  a.mechanical = std::move(m.model);
  a.mechanism = std::move(m.mechanism);
}
/// Maximal ones if they cost clearly less: they are estimated up to 40 % too low.
void choose_coordinates(const Scene& scene, Assembly& a) {
  a.why_coordinates = scene.why_coordinates;
  if (scene.coordinates != Coordinates::faster) return;
  if (scene.constraints.empty()) {
    a.why_coordinates = "there are no loops";
    return;
  }
  try {
    Maximal m = maximal_of(scene, a);
    const double reduced = mechanics::estimated_step(*a.mechanical),
                 maximal = mechanics::estimated_step(*m.model);
    a.why_coordinates = fmt::format(
        "estimated {:.2g} ms a step, {:.2g} ms in {} ones", 1e-3 * std::min(reduced, maximal),
        1e-3 * std::max(reduced, maximal), maximal < reduced ? "reduced" : "maximal");
    if (maximal < 0.75 * reduced)
      take_maximal_coordinates(a, std::move(m));
    else if (maximal < reduced)
      a.why_coordinates = "estimated as fast as maximal ones";
  } catch (const InvalidArgument& e) {
    a.why_coordinates = std::string("maximal ones are refused: ") + e.what();
  }
}

Assembly assemble_model(const Scene& scene, const mechanics::UrdfOptions& options) {
  auto urdf = mechanics::parse_urdf(scene.urdf_text, scene.urdf_path, options);
  Assembly a;
  a.notes = std::move(urdf.notes);
  a.parts = std::move(urdf.parts);
  for (const auto& b : scene.bodies) a.parts.add(part_of(b));
  for (const auto& p : scene.panels) add_panel(a.parts, p);
  scale_masses(a.parts, scene.mass_factor);
  const bool as_in_file = scene.bodies.empty() && scene.panels.empty() && scene.mass_factor.empty();
  a.mechanism =
      std::make_shared<const Mechanism>(as_in_file ? std::move(urdf.mechanism) : a.parts.build());
  const auto& remarks = a.mechanism->remarks();
  a.notes.insert(a.notes.end(), remarks.begin(), remarks.end());
  a.mechanical = with_constraints(a.mechanism, scene, urdf.mimics);
  if (scene.coordinates == Coordinates::maximal) {
    try {
      take_maximal_coordinates(a, maximal_of(scene, a));
    } catch (const InvalidArgument& e) {
      throw scene.constraints.placed(e);
    }
  }
  choose_coordinates(scene, a);
  AddedControllers added;
  a.model = with_joint_parts(a.mechanical, scene, &added);
  a.certificates = std::move(added.certificates);
  a.hindered = std::move(added.hindered);
  a.remarks = std::move(added.remarks);
  check_contacts(scene, *a.model);
  if (scene.orbit) {
    try {
      a.spacecraft = std::make_shared<const space::Spacecraft>(
          a.mechanical, a.model, scene.orbit->environment, orbit_parts_of(scene));
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(in_file(scene.orbit->where) + e.what());
    }
    a.model = a.spacecraft;
    a.splitting = scene.orbit->splitting;
  }
  auto start = start_of(scene, a);
  if (!start.note.empty()) a.notes.push_back({scene.path, start.note});
  a.initial = std::move(start.state);
  const phs::Description& d = a.model->description();
  for (const auto& jump : command_jumps(scene.actuators, d, phs::with_turns(d, a.initial)))
    a.notes.push_back({jump.substr(0, jump.find(": ")), jump.substr(jump.find(": ") + 2)});
  for (const Element& e : scene.elements)
    if (!e.remark.empty())
      a.notes.push_back({e.where, fmt::format("element '{}': {}", e.name, e.remark)});
  check_overlaps(scene, *a.model, a.initial);
  const auto depths = notes_on_depths(scene, *a.model, a.initial);
  a.notes.insert(a.notes.end(), depths.begin(), depths.end());
  a.centre = start.centre;
  if (!scene.outputs.empty()) (void)stop_events(scene, a);  // refuses what they cannot be
  (void)Outputs(scene, a);
  return a;
}
}  // namespace

std::map<std::string, std::vector<double>> locked_places(const Scene& scene) {
  auto places = reading_of(scene).locked_at;
  for (const std::string& name : scene.urdf.locked) places.try_emplace(name);
  return places;
}

Assembly assemble(const Scene& scene) {
  const bool free_base = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  if (!free_base && !scene.base.where.empty())
    throw InvalidArgument(scene.base.where +
                          ": [initial] base is given, but the base is \"fixed\": expected no start "
                          "values of the base, "
                          "or [model] base = \"free\"");
  try {
    mechanics::UrdfOptions options = reading_of(scene);
    if (why_centre_stays(scene).empty())
      options.gravity = {0, 0, 0};  // the centre of mass feels it
    return assemble_model(scene, options);
  } catch (const mechanics::MasslessPart& e) {
    throw with_ways_out(e, scene);
  } catch (const mechanics::UnphysicalInertia& e) {
    throw InvalidArgument(e.what() +
                          std::string(", or [model] unphysical_inertia = \"accept\" to take it"));
  }
}

Assembly assembly_of(std::shared_ptr<const phs::Model> model, std::span<const double> x) {
  require_size("start state", x.size(), size_t(model->description().nx));
  Assembly a;
  a.initial = phs::State(model->description(), std::vector<double>(x.begin(), x.end()));
  phs::wrap_angles(model->description(), a.initial);
  a.model = std::move(model);
  return a;
}

}  // namespace porthos::scene
