#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "scene/part.h"
#include "scene/scene.h"
#include "scene/variation.h"
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

/// Uniform in [-bound, bound) from the top 53 bits: the standard's distributions differ between libraries.
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

[[noreturn]] void refuse_joint(const std::string& name, const JointStart& start,
                               const Mechanism& m) {
  std::string known;
  const char* reason = "the model has no joint of this name";
  for (const auto& c : m.coordinates()) {
    if (is_single(c)) known += (known.empty() ? "" : ", ") + c.name;
    if (!is_single(c) && (c.name == name || c.joint == name))
      reason = "it has several freedoms, start values are for joints of one";
  }
  throw InvalidArgument(fmt::format("{}[initial] joints.{}: {}, expected one of: {}",
                                    at(start.where), name, reason,
                                    known.empty() ? "(none)" : known));
}

void put_joint(const std::string& name, const JointStart& start, const Mechanism& m, Start& s) {
  const auto& all = m.coordinates();
  const auto c = std::find_if(all.begin(), all.end(),
                              [&](const auto& k) { return is_single(k) && k.name == name; });
  if (c == all.end()) refuse_joint(name, start, m);
  s.q[size_t(c->q)] = start.position;
  s.v[size_t(c->v)] = start.velocity;
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

/// Rates of a free joint are the twist in the base's own axes: the world velocity of its origin is turned into them.
void put_base(const BaseStart& b, const std::string& joint, const Mechanism& m, Start& s) {
  const auto& position = m.coordinate(joint + ".position");
  const auto& attitude = m.coordinate(joint + ".attitude");
  store(b.position, s.q, position.q);
  std::copy_n(b.attitude_wxyz, 4, s.q.begin() + attitude.q);
  const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(b.attitude_wxyz));
  store(b.angular_velocity, s.v, attitude.v);
  store(R.tmul(b.linear_velocity), s.v, position.v);
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
  part.name = b.name, part.parent = "world", part.where = b.where;
  part.joint.type = "free", part.joint.name = b.name, part.mass = b.mass;
  return part;
}

void scale_masses(mechanics::MechanismBuilder& parts,
                  const std::map<std::string, double>& factors) {
  for (const auto& [link, factor] : factors) {
    auto& all = parts.bodies();
    const auto b =
        std::find_if(all.begin(), all.end(), [&](const auto& k) { return k.name == link; });
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

Assembly assemble(const Scene& scene) {
  const bool free_base = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  if (!free_base && !scene.base.where.empty())
    throw InvalidArgument(scene.base.where +
                          ": [initial] base is given, but the base is \"fixed\": expected no start "
                          "values of the base, "
                          "or [model] base = \"free\"");
  mechanics::UrdfOptions options = scene.urdf;
  if (why_centre_stays(scene).empty()) options.gravity = {0, 0, 0};  // the centre of mass feels it
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
  a.initial = std::move(start.state), a.centre = std::move(start.centre);
  return a;
}

Beginning start_of(const Scene& scene, const Assembly& a) {
  const bool free_base = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  const bool apart = why_centre_stays(scene).empty();
  // What the mechanism and its parts make up, without the orbit.
  const phs::Model& internal = a.spacecraft ? a.spacecraft->internal() : *a.model;
  Start start{a.mechanism->neutral(), std::vector<double>(size_t(a.mechanism->nv()), 0.0)};
  if (scene.random) put_random(*scene.random, *a.mechanism, start);
  for (const auto& [name, joint] : scene.joints) put_joint(name, joint, *a.mechanism, start);
  const BaseStart from = apart ? scene.base : BaseStart{};
  if (free_base)
    put_base(seen_from(from, scene.base), mechanics::base_joint_name, *a.mechanism, start);
  for (const auto& b : scene.bodies)
    put_base(seen_from(from, b.start), b.name, *a.mechanism, start);
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
                                     .iteration_tolerance = scene.iteration_tolerance};
  if (scene.orbit)
    if (const auto* craft = dynamic_cast<const space::Spacecraft*>(&model)) try {
        return std::make_unique<space::SplitIntegrator>(
            *craft, h, space::SplitOptions{scene.orbit->splitting, scene.method, options});
      } catch (const InvalidArgument& e) {
        throw InvalidArgument(at(scene.orbit->where) + e.what());
      }
  return integrators::make_controlled(scene.step_control, scene.method, model, h,
                                      {.rate = scene.control_rate, .length = scene.control_length},
                                      options);
}

}  // namespace porthos::scene
