#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "scene/assemble/assembly.h"
#include "scene/assemble/parts.h"
#include "scene/read/variation.h"
#include "space/split_integrator.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates;
using mechanics::Mechanism;
using mechanics::Vec3d;

/// q and v while they are filled in.
struct Start {
  std::vector<double> q, v;
};

std::string at(const std::string& where) { return where.empty() ? "" : where + ": "; }

/// Coordinates that one number and one rate describe.
bool is_single(const JointCoordinates& c) { return c.nq == 1 && c.nv == 1; }

/// Uniform in [-bound, bound) from the top 53 bits: the standard's distributions differ between
/// libraries.
double symmetric_uniform(std::mt19937_64& rng, double bound) {
  const double unit = double(rng() >> 11) * 0x1p-53;
  return bound * (2 * unit - 1);
}

void put_random(const RandomStart& random, const Mechanism& m, Start& s) {
  std::mt19937_64 rng(random.seed);
  for (const auto& c : m.coordinates()) {
    if (!is_single(c)) continue;
    s.q[size_t(c.q)] = symmetric_uniform(rng, random.joint_position);
    s.v[size_t(c.v)] = symmetric_uniform(rng, random.joint_velocity);
  }
}

[[noreturn]] void refuse_start(const std::string& name, const JointStart& start,
                               const std::string& why) {
  throw InvalidArgument(fmt::format("{}[initial] joints.{}: {}", at(start.where), name, why));
}

/// Why nothing of this name can be given a start.
std::string no_start(const std::string& name, const Mechanism& m) {
  std::string known, own;
  for (const auto& c : m.coordinates()) {
    const bool turns = c.kind == phs::BlockKind::rotation;
    if (is_single(c) || turns) known += (known.empty() ? "" : ", ") + (turns ? c.joint : c.name);
    if (c.joint == name) own += (own.empty() ? "" : ", ") + c.name;
  }
  return own.empty() ? "the model has no joint of this name, expected one of: " +
                           (known.empty() ? "(none)" : known)
                     : "it has several freedoms, expected each of them by its name: " + own;
}

void store(const Vec3d& a, std::vector<double>& to, int offset) {
  for (int k = 0; k < 3; ++k) to[size_t(offset + k)] = a[k];
}

/// As seen from the base's origin: relative motion has no rounding of a common one.
BaseStart seen_from(const BaseStart& base, BaseStart b) {
  b.position -= base.position;
  b.linear_velocity -= base.linear_velocity;
  return b;
}

/// Rates of ball and free joints are the twist in the child's own axes: a velocity in the parent's
/// is turned into them.
/// @param position  null: it cannot move away
void put_motion(const BaseStart& b, const JointCoordinates& attitude,
                const JointCoordinates* position, Start& s) {
  std::copy_n(b.attitude_wxyz, 4, s.q.begin() + attitude.q);
  store(b.angular_velocity, s.v, attitude.v);
  if (!position) return;
  const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(b.attitude_wxyz));
  store(b.position, s.q, position->q);
  store(R.tmul(b.linear_velocity), s.v, position->v);
}

void put_base(const BaseStart& b, const std::string& joint, const Mechanism& m, Start& s) {
  put_motion(b, m.coordinate(joint + ".attitude"), &m.coordinate(joint + ".position"), s);
}

void put_joint(const std::string& name, const JointStart& start, const Mechanism& m, Start& s) {
  const JointCoordinates *single = nullptr, *attitude = nullptr, *position = nullptr;
  for (const auto& c : m.coordinates()) {
    if (is_single(c) && c.name == name) single = &c;
    if (c.joint != name) continue;
    if (c.kind == phs::BlockKind::rotation) attitude = &c;
    if (c.name == name + ".position") position = &c;
  }
  if (single && start.motion)
    refuse_start(name, start, "it has one freedom, expected position and velocity");
  if (single) {
    s.q[size_t(single->q)] = start.position;
    s.v[size_t(single->v)] = start.velocity;
    return;
  }
  if (!attitude) refuse_start(name, start, no_start(name, m));
  if (!start.motion)
    refuse_start(name, start,
                 "it is a joint that turns freely, expected attitude_wxyz and "
                 "angular_velocity");
  if (!position && start.translates)
    refuse_start(name, start, "it is a ball joint, expected no position and no linear_velocity");
  put_motion(*start.motion, *attitude, position, s);
}

/// A locked joint, or a coordinate of one.
bool is_locked(const Scene& scene, const std::string& name) {
  const auto& all = scene.urdf.locked;
  return std::any_of(all.begin(), all.end(), [&](const std::string& joint) {
    return name == joint || name.rfind(joint + ".", 0) == 0;
  });
}

/// How to read the model: with the locked joints where they start.
mechanics::UrdfOptions reading_of(const Scene& scene) {
  mechanics::UrdfOptions o = scene.urdf;
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

/// A refusal of something massless that moves, with the ways out that a scene has.
InvalidArgument with_ways_out(const mechanics::MasslessPart& e, const Scene& scene) {
  std::string ways;
  const auto add = [&](const std::string& way) { ways += (ways.empty() ? "" : ", or ") + way; };
  if (!e.joint.empty() && e.joint != mechanics::base_joint_name)
    add(fmt::format("[model] lock = [\"{}\"] holds the joint where it starts", e.joint));
  if (!e.links.empty()) add(fmt::format("[model.inertia.{}] gives the link mass", e.links.front()));
  if (scene.urdf.links_without_inertia == mechanics::UrdfOptions::NoInertia::error)
    add("[model] links_without_inertia = \"massless\" if links with mass follow");
  return InvalidArgument(e.what() + (ways.empty() ? "" : ": " + ways));
}

/// A refusal names the part; the line is that of its element.
std::shared_ptr<const phs::Model> with_parts(
    std::shared_ptr<const mechanics::MechanicalModel> mechanical, const Scene& scene,
    const space::Parts& parts) {
  try {
    return std::make_shared<const space::PartsModel>(std::move(mechanical), parts);
  } catch (const InvalidArgument& why) {
    const std::string text = why.what();
    for (const Element& e : scene.elements)
      if (text.find("'" + e.name) != std::string::npos) throw InvalidArgument(at(e.where) + text);
    throw;
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
      std::string known;
      for (const auto& k : all) known += (known.empty() ? "" : ", ") + k.name;
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
    std::shared_ptr<const mechanics::MechanicalModel> mechanical, const Scene& scene) {
  if (scene.elements.empty() && scene.actuators.empty()) return mechanical;
  std::shared_ptr<const phs::Model> body = mechanical;
  if (space::Parts parts = parts_of(scene); parts.any())
    body = with_parts(mechanical, scene, parts);
  if (scene.actuators.empty() && std::all_of(scene.elements.begin(), scene.elements.end(),
                                             [](const Element& e) { return e.joint.empty(); }))
    return body;
  phs::Network n(mechanical->description().name);
  n.add("mechanism", body).main("mechanism");
  add_elements(n, *mechanical, scene.elements);
  add_actuators(n, *mechanical, scene.actuators);
  return n.build();
}

namespace {
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
  a.mechanical = std::make_shared<const mechanics::MechanicalModel>(a.mechanism);
  a.model = with_joint_parts(a.mechanical, scene);
  if (scene.orbit) {
    try {
      a.spacecraft = std::make_shared<const space::Spacecraft>(
          a.mechanical, a.model, scene.orbit->environment, orbit_parts_of(scene));
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(at(scene.orbit->where) + e.what());
    }
    a.model = a.spacecraft;
    a.splitting = scene.orbit->splitting;
  }
  auto start = start_of(scene, a);
  a.initial = std::move(start.state);
  a.centre = start.centre;
  return a;
}
}  // namespace

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
  }
}

Beginning start_of(const Scene& scene, const Assembly& a) {
  const bool free_base = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  const bool apart = why_centre_stays(scene).empty();
  // What the mechanism and its parts make up, without the orbit.
  const phs::Model& internal = a.spacecraft ? a.spacecraft->internal() : *a.model;
  Start start{a.mechanism->neutral(), std::vector<double>(size_t(a.mechanism->nv()), 0.0)};
  if (scene.random) put_random(*scene.random, *a.mechanism, start);
  for (const auto& [name, joint] : scene.joints) {
    if (free_base && name == mechanics::base_joint_name)
      refuse_start(name, joint, "it is the free base, expected its start in [initial] base");
    for (const auto& b : scene.bodies)
      if (name == b.name) refuse_start(name, joint, "expected its start in its [[body]]");
    if (!is_locked(scene, name)) put_joint(name, joint, *a.mechanism, start);
  }
  const BaseStart from = apart ? scene.base : BaseStart{};
  if (free_base)
    put_base(seen_from(from, scene.base), mechanics::base_joint_name, *a.mechanism, start);
  for (const auto& b : scene.bodies)
    put_base(seen_from(from, b.start), b.name, *a.mechanism, start);
  if (const auto joint = mechanics::joint_without_inertia(*a.mechanism, start.q))
    throw InvalidArgument(fmt::format(
        "{}: joint '{}' moves no inertia where it starts, a singular position: expected another "
        "start of the joints in [initial]",
        scene.path, *joint));
  CentreOfMass centre;
  if (apart) centre = take_centre_out(*a.mechanism, start.q, start.v);
  auto x = a.mechanical->state(start.q, start.v);
  x.resize(size_t(internal.description().nx), 0.0);  // elements start empty
  for (const auto& [name, own] : start_actuators(*a.mechanical, scene.actuators, start.q))
    std::copy(own.begin(), own.end(),
              x.begin() + dynamic_cast<const phs::NetworkModel&>(internal).offset(name));
  if (a.spacecraft) try {
      x = a.spacecraft->state(x, scene.orbit->start);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(at(scene.orbit->where) + e.what());
    }
  phs::State s(a.model->description(), std::move(x));
  phs::wrap_angles(a.model->description(), s);
  if (!apart) return {std::move(s), {}};
  settle_momentum(*a.mechanism, s);
  centre.start += CentreOfMass::Vec(from.position);
  centre.start_velocity += CentreOfMass::Vec(from.linear_velocity);
  centre.gravity = CentreOfMass::Vec(scene.urdf.gravity);
  return {std::move(s), centre};
}

Assembly assembly_of(std::shared_ptr<const phs::Model> model, std::span<const double> x) {
  require_size("start state", x.size(), size_t(model->description().nx));
  Assembly a;
  a.initial = phs::State(model->description(), std::vector<double>(x.begin(), x.end()));
  phs::wrap_angles(model->description(), a.initial);
  a.model = std::move(model);
  return a;
}

std::unique_ptr<integrators::Integrator> make_integrator(const Assembly& a,
                                                         const std::string& method, double h,
                                                         const integrators::Options& options) {
  if (!a.spacecraft) return integrators::make_integrator(method, *a.model, h, options);
  return std::make_unique<space::SplitIntegrator>(
      *a.spacecraft, h, space::SplitOptions{a.splitting, method, options});
}

std::unique_ptr<integrators::Integrator> make_integrator(const Scene& scene,
                                                         const phs::Model& model, double h) {
  check_switching(scene, h);
  const integrators::Options options{.rtol = scene.rtol,
                                     .iteration_tolerance = scene.iteration_tolerance,
                                     .instants = switches_of(scene)};
  if (scene.orbit)
    if (const auto* craft = dynamic_cast<const space::Spacecraft*>(&model)) try {
        return std::make_unique<space::SplitIntegrator>(
            *craft, h, space::SplitOptions{scene.orbit->splitting, scene.method, options});
      } catch (const InvalidArgument& e) {
        throw InvalidArgument(at(scene.orbit->where) + e.what());
      }
  auto method = integrators::make_controlled(
      scene.step_control, scene.method, model, h,
      {.rate = scene.control_rate, .length = scene.control_length}, options);
  if (!method->sees_inside())
    for (const Element& e : scene.elements)
      if (e.thruster)
        throw InvalidArgument(e.where + ": thruster '" + e.name +
                              "' switches at the ends of steps, where " + scene.method +
                              " has a stage: it would push before its time, expected a method that "
                              "keeps a ledger of its own, such as gauss8");
  return method;
}

}  // namespace porthos::scene
