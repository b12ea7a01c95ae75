// The start of a run: the start values of a scene as a state of its model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "mechanics/constraints/maximal.h"
#include "mechanics/constraints/projection.h"
#include "mechanics/rotation.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/detail/start.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates;
using mechanics::Mechanism;
using mechanics::Vec3d;

/// Coordinates that one number and one rate describe.
bool is_single(const JointCoordinates& c) { return c.nq == 1 && c.nv == 1; }

/// Uniform in [-bound, bound) from the top 53 bits. The distributions of the standard library
/// differ between implementations.
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

/// The reason why a start cannot be given for this name.
std::string no_start(const std::string& name, const Mechanism& m) {
  std::string known, own;
  for (const auto& c : m.coordinates()) {
    const bool turns = c.kind == phs::BlockKind::rotation;
    if (is_single(c) || turns) add_to_list(known, (turns ? c.joint : c.name));
    if (c.joint == name) add_to_list(own, c.name);
  }
  return own.empty()
             ? "the model has no joint of this name, expected one of: " +
                   (known.empty() ? "(none)" : known)
             : "it has several degrees of freedom, expected each of them by its name: " + own;
}

void store(const Vec3d& a, std::vector<double>& to, int offset) {
  for (int k = 0; k < 3; ++k) to[size_t(offset + k)] = a[k];
}

/// Relative to the base's origin, so that relative motion has no rounding error of a common one.
BaseStart seen_from(const BaseStart& base, BaseStart b) {
  b.position -= base.position;
  b.linear_velocity -= base.linear_velocity;
  return b;
}

/// Rates of ball and free joints are the twist in the child's own axes: a velocity in the parent's
/// axes is rotated into them.
/// @param position  null: the joint has no translation
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
    refuse_start(name, start, "it has one degree of freedom, expected position and velocity");
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

/// The joints and bodies whose start the scene states, as indices in v: their places, or their
/// rates, which those that state a position alone leave to the loops.
std::vector<int> stated(const Scene& scene, const Mechanism& m, bool rates) {
  std::vector<int> list;
  for (const auto& c : m.coordinates()) {
    auto own = scene.joints.find(c.name);
    if (own == scene.joints.end()) own = scene.joints.find(c.joint);
    const bool counts = c.joint == mechanics::base_joint_name ||
                        (own != scene.joints.end() &&
                         (!rates || own->second.motion || own->second.states_velocity));
    for (int k = 0; counts && k < c.nv; ++k) list.push_back(c.v + k);
  }
  return list;
}

/// A driven joint starts on its motion.
void put_driven(const Scene& scene, const Mechanism& m, Start& s) {
  for (const auto& d : scene.constraints.spec.driven) {
    const auto& c = m.coordinate(d.coordinate);
    const double q = (*d.motion.position)(0.0), v = (*d.motion.rate)(0.0);
    if (const auto stated = scene.joints.find(d.coordinate); stated != scene.joints.end()) {
      const JointStart& j = stated->second;
      if (std::fabs(j.position - q) > 1e-9 * (1 + std::fabs(q)) ||
          std::fabs(j.velocity - v) > 1e-9 * (1 + std::fabs(v)))
        refuse_start(d.coordinate, j,
                     fmt::format("its motion '{}' starts at {:g} with the rate {:g}, expected the "
                                 "same, or no start",
                                 d.name, q, v));
    }
    s.q[size_t(c.q)] = q;
    s.v[size_t(c.v)] = v;
  }
}

/// Of the joints whose start the scene states, those that have moved from their numbers.
std::string moved_from_stated(const Scene& scene, const Mechanism& m,
                              const std::vector<double>& q) {
  std::string list;
  for (const auto& c : m.coordinates()) {
    const auto stated = scene.joints.find(c.name);
    if (stated == scene.joints.end() || !is_single(c)) continue;
    const double from = stated->second.position, to = q[size_t(c.q)];
    if (std::fabs(to - from) > 1e-9 * (1 + std::fabs(from)))
      add_to_list(list, fmt::format("'{}' from {:.6g} to {:.6g}", c.name, from, to));
  }
  return list.empty() ? ""
                      : "; of the joints whose start is stated, also " + list +
                            ": expected a stated start of fewer joints";
}

/// @throws InvalidArgument where stated rates contradict the constraints by more than their digits
void check_stated_rates(const Scene& scene, const Mechanism& m, const std::vector<double>& v) {
  constexpr double digits = 0.01;
  double largest = 0;
  for (const auto& [name, start] : scene.joints)
    largest = std::max(largest, std::fabs(start.velocity));
  std::string list, where;
  for (const auto& c : m.coordinates()) {
    const auto stated = scene.joints.find(c.name);
    if (stated == scene.joints.end() || !stated->second.states_velocity || !is_single(c)) continue;
    const double from = stated->second.velocity, to = v[size_t(c.v)];
    if (std::fabs(to - from) <= digits * largest) continue;
    if (where.empty()) where = stated->second.where;
    add_to_list(list, fmt::format("'{}' {:.6g} to {:.6g} {}", c.name, from, to, c.rate_unit));
  }
  if (!list.empty())
    throw InvalidArgument(fmt::format(
        "{}[initial] joints: the stated velocities contradict the constraints, which would change "
        "{}: expected those of fewer joints, the others follow",
        in_file(where), list));
}

/// Moves the start onto the loops. @return a note of the move, empty if it is rounding
std::string put_on_loops(const Scene& scene, const Assembly& a, Start& s) {
  const auto& model = a.reduced ? *a.reduced : *a.mechanical;
  const auto* loops = model.constraint_set();
  if (!loops) return "";
  const auto& m = model.mechanism();
  const auto moved = [&] {
    try {
      return mechanics::close_loops(m, *loops, s.q, s.v, stated(scene, m, false),
                                    stated(scene, m, true));
    } catch (const InvalidArgument& e) {
      throw scene.constraints.placed(e);
    }
  }();
  // What rolls loses the speed that it cannot have, and a mechanism without freedom all of it.
  if (moved.rank < m.nv() && scene.constraints.spec.rollings.empty())
    check_stated_rates(scene, m, s.v);
  const std::string stiff =
      moved.rank < m.nv() ? ""
      : !scene.constraints.spec.driven.empty()
          ? "every joint moves as told"
          : fmt::format(
                "the constraints leave no degree of freedom, {} independent rows for {} rates: "
                "nothing can move",
                moved.rank, m.nv());
  if (moved.moved < 1e-12 && moved.sped_up < 1e-12) return stiff;
  const std::string gap =
      moved.gap < 1e-12
          ? ""
          : fmt::format("the largest gap was {:.3g} m or rad, of '{}', ", moved.gap, moved.largest);
  return fmt::format(
      "{}the start was moved onto the constraints: {}coordinates changed by up to {:.3g}, rates "
      "by up to {:.3g}{}",
      stiff.empty() ? "" : stiff + "; ", gap, moved.moved, moved.sped_up,
      moved_from_stated(scene, m, s.q));
}

/// Coordinates and rates of a record.
FromRecord put_record(const StartFrom& from, const Assembly& a, Start& s) {
  const auto& m = *a.mechanism;
  if (!from.joined.holds.empty()) {
    auto record = numbers_of(from, a.model->description(), 0);
    std::fill_n(record.known.begin(), 2 * m.nq(), false);
    s = taken_apart(from, a.parts);
    return record;
  }
  auto record = numbers_of(from, a.model->description(), 2 * m.nq());
  const auto x = std::span<const double>(record.state.x).first(size_t(2 * m.nq()));
  s.q.assign(x.begin(), x.begin() + m.nq());
  s.v = a.mechanical->rates(x, record.state.turns);
  return record;
}

double kinetic_energy_of(const mechanics::MechanicalModel& model, const Start& s) {
  const auto& m = model.mechanism();
  mechanics::Workspace<double> w(m);
  const auto x = model.state(s.q, s.v);
  const size_t nq = size_t(m.nq());
  return mechanics::kinetic_energy<double>(m, w, std::span(x).first(nq),
                                           std::span(x).subspan(nq, nq));
}

/// From the joints' coordinates to those of the free bodies.
void move_to_bodies(const Assembly& a, Start& s) {
  const phs::State joints(a.reduced->description(), a.reduced->state(s.q, s.v));
  const auto bodies = mechanics::maximal_state(*a.reduced, joints, *a.mechanical);
  s.v = a.mechanical->rates(bodies.x);
  s.q.assign(bodies.x.begin(), bodies.x.begin() + a.mechanism->nq());
}

}  // namespace

void refuse_start(const std::string& name, const JointStart& start, const std::string& why) {
  throw InvalidArgument(fmt::format("{}[initial] joints.{}: {}", in_file(start.where), name, why));
}

bool is_locked(const Scene& scene, const std::string& name) {
  const auto& all = scene.urdf.locked;
  return std::any_of(all.begin(), all.end(), [&](const std::string& joint) {
    return name == joint || name.rfind(joint + ".", 0) == 0;
  });
}

Beginning start_of(const Scene& scene, const Assembly& a) {
  const bool free_base = scene.urdf.base == mechanics::UrdfOptions::Base::free;
  const bool apart = why_centre_stays(scene).empty();
  // The model of the mechanism and its parts, without the orbit.
  const phs::Model& internal = a.internal();
  const Mechanism& joints = a.reduced ? a.reduced->mechanism() : *a.mechanism;
  Start start{joints.neutral(), std::vector<double>(size_t(joints.nv()), 0.0)};
  if (scene.random) put_random(*scene.random, joints, start);
  for (const auto& [name, joint] : scene.joints) {
    if (free_base && name == mechanics::base_joint_name)
      refuse_start(name, joint, "it is the free base, expected its start in [initial] base");
    for (const auto& b : scene.bodies)
      if (name == b.name) refuse_start(name, joint, "expected its start in its [[body]]");
    for (const auto& r : scene.robots)
      if (name == r.name) refuse_start(name, joint, "expected its start in its [[robot]]");
    if (!is_locked(scene, name)) put_joint(name, joint, joints, start);
  }
  put_driven(scene, joints, start);
  std::optional<FromRecord> record;
  if (scene.start_from) record = put_record(*scene.start_from, a, start);
  const BaseStart from = apart ? scene.base : BaseStart{};
  if (free_base && !record)
    put_base(seen_from(from, scene.base), mechanics::base_joint_name, joints, start);
  for (const auto& r : scene.robots)
    if (!record && r.free) put_base(seen_from(from, r.start), r.name, joints, start);
  for (const auto& b : scene.bodies)
    if (!record) put_base(seen_from(from, b.start), b.name, joints, start);
  if (const auto joint = mechanics::joint_without_inertia(joints, start.q))
    throw InvalidArgument(fmt::format(
        "{}: joint '{}' moves no inertia where it starts, a singular position: expected another "
        "start of the joints in [initial]",
        scene.path, *joint));
  std::string note = record ? "" : put_on_loops(scene, a, start);
  if (a.reduced && !record) move_to_bodies(a, start);
  const double with_centre = record ? kinetic_energy_of(*a.mechanical, start) : 0;
  CentreOfMass centre;
  if (apart) centre = take_centre_out(*a.mechanism, start.q, start.v);
  if (record)
    note =
        note_of(*scene.start_from, *record, {with_centre, kinetic_energy_of(*a.mechanical, start)},
                scene.orbit ? &*scene.orbit : nullptr, a.parts);
  auto x = a.mechanical->state(start.q, start.v);
  x.resize(size_t(internal.description().nx), 0.0);  // elements start without stored energy
  for (const auto& [name, own] : start_actuators(*a.mechanical, scene.actuators, start.q))
    std::copy(own.begin(), own.end(),
              x.begin() + dynamic_cast<const phs::NetworkModel&>(internal).offset(name));
  for (const Controller& c : scene.controllers)
    if (c.tank)
      x[size_t(dynamic_cast<const phs::NetworkModel&>(internal).offset(c.tank_name()))] =
          c.tank->level;
  if (a.spacecraft) try {
      x = a.spacecraft->state(x, scene.orbit->start);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(in_file(scene.orbit->where) + e.what());
    }
  phs::State s(a.model->description(), std::move(x));
  phs::wrap_angles(a.model->description(), s);
  if (record && !apart) put_exactly(*record, s);
  if (record && apart) s.turns = record->state.turns;
  if (!apart) return {std::move(s), {}, note};
  settle_momentum(*a.mechanism, s);
  centre.start += CentreOfMass::Vec(from.position);
  centre.start_velocity += CentreOfMass::Vec(from.linear_velocity);
  centre.gravity = CentreOfMass::Vec(scene.urdf.gravity);
  return {std::move(s), centre, note};
}

}  // namespace porthos::scene
