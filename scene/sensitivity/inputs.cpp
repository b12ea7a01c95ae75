#include "scene/sensitivity/inputs.h"

#include <algorithm>
#include <cmath>

#include "integrators/derivatives/run_instants.h"
#include "mechanics/derivatives/linearised_mechanism.h"
#include "mechanics/rotation.h"

namespace porthos::scene {
namespace {

using mechanics::JointCoordinates;
using mechanics::JointProperties;
using mechanics::MassProperties;
using mechanics::Mat3;
using mechanics::Vec3d;

constexpr const char* axis_names[] = {".x", ".y", ".z"};
constexpr int of_body = 10;  ///< parameters

/// The other block of a joint that turns and moves freely; null if it has none.
const JointCoordinates* block_beside(const mechanics::Mechanism& m, const JointCoordinates& own) {
  for (const auto& c : m.coordinates())
    if (c.joint == own.joint && c.name != own.name && own.nv == 3 && c.nv == 3) return &c;
  return nullptr;
}

Vec3d three(std::span<const double> x, int at) {
  return {x[size_t(at)], x[size_t(at) + 1], x[size_t(at) + 2]};
}

/// From the slopes g by mass, first moment and inertia about the origin to those by mass, centre
/// and the inertia about it along its axes: with dI = Σ G_ij dI_ij, I = A Iᵃ Aᵀ + m (c² 1 - c cᵀ).
void in_central_numbers(const MassProperties& b, const double* g, std::vector<double>& to) {
  const double* i = g + 4;  // xx xy xz yy yz zz; a mixed one changes both elements
  const Mat3<double> G{
      {i[0], i[1] / 2, i[2] / 2}, {i[1] / 2, i[3], i[4] / 2}, {i[2] / 2, i[4] / 2, i[5]}};
  const Vec3d by_moment{g[1], g[2], g[3]}, &c = b.com, Gc = G * c;
  const double trace = i[0] + i[3] + i[5];
  const Vec3d by_centre = b.mass * (by_moment + 2 * (trace * c - Gc));
  to.push_back(g[0] + dot(by_moment, c) + trace * dot(c, c) - dot(c, Gc));
  for (int k = 0; k < 3; ++k) to.push_back(by_centre[k]);
  const Vec3d axes[] = {b.axes.x, b.axes.y, b.axes.z};
  for (int k = 0; k < 3; ++k)
    for (int l = k; l < 3; ++l) to.push_back((k == l ? 1 : 2) * dot(axes[k], G * axes[l]));
}

}  // namespace

Inputs::Inputs(const Assembly& a, const std::vector<std::string>& names)
    : assembly_(a), names_(names) {
  const auto x = phs::with_turns(a.model->description(), a.initial);
  q_.assign(x.begin(), x.begin() + a.mechanism->nq());
  v_ = a.mechanical->rates(std::span(a.initial.x).first(2 * q_.size()), a.initial.turns);
  double largest = 0;
  for (const double rate : v_) largest = std::max(largest, std::fabs(rate));
  for (double& rate : v_)  // from momenta: zeros come back as roundings
    if (std::fabs(rate) < 1e-15 * largest) rate = 0;
  if (!names_.empty()) add_parameters();
  add_starts();
}

void Inputs::add_parameters() {
  const auto& m = *assembly_.mechanism;
  const auto add = [&](const std::string& name, const std::string& unit, double value) {
    list_.push_back({name, unit, value});
  };
  for (const auto& body : m.bodies()) {
    if (body.node < 0) continue;
    const auto given =
        std::ranges::find(assembly_.parts.bodies(), body.name, &mechanics::BodySpec::name);
    const MassProperties& p = given->mass;
    bodies_.push_back(&p);
    add(body.name + ".mass", "kg", p.mass);
    for (int k = 0; k < 3; ++k) add(body.name + ".com" + axis_names[k], "m", p.com[k]);
    const auto& I = p.inertia;
    const std::pair<const char*, double> elements[] = {{"xx", I.xx}, {"xy", I.xy}, {"xz", I.xz},
                                                       {"yy", I.yy}, {"yz", I.yz}, {"zz", I.zz}};
    for (const auto& [element, value] : elements)
      add(body.name + ".inertia." + element, "kg m^2", value);
  }
  const auto of_joints = [&](const char* what, double JointProperties::*number, auto unit) {
    for (const auto& j : m.joint_properties()) {
      const auto own = std::ranges::find(m.coordinates(), j.q, &JointCoordinates::q);
      add(j.joint + what, unit(*own), j.*number);
    }
  };
  const auto turns = [](const JointCoordinates& c) { return c.unit == "rad"; };
  of_joints(".rotor_inertia", &JointProperties::rotor_inertia,
            [&](const auto& c) { return turns(c) ? "kg m^2" : "kg"; });
  of_joints(".stiffness", &JointProperties::stiffness,
            [&](const auto& c) { return c.effort_unit + "/" + c.unit; });
  of_joints(".damping", &JointProperties::damping,
            [&](const auto& c) { return c.effort_unit + (turns(c) ? " s/rad" : " s/m"); });
  of_joints(".rest", &JointProperties::rest, [](const auto& c) { return c.unit; });
  const auto gains = integrators::gains_of_run(*assembly_.model);
  while (list_.size() < names_.size() - gains.size()) add(names_[list_.size()], "1", 1);  // factors
  for (const auto& gain : gains) add(gain.name, gain.unit, gain.value);
}

void Inputs::add_starts() {
  const auto& m = *assembly_.mechanism;
  const auto add = [&](const std::string& name, const std::string& unit, double value) {
    list_.push_back({name, unit, value, true});
  };
  const auto add_three = [&](const std::string& name, const std::string& unit, const Vec3d& value) {
    for (int k = 0; k < 3; ++k) add(name + axis_names[k], unit, value[k]);
  };
  for (const auto& c : m.coordinates()) {
    if (c.nv == 1) {
      add(c.name + ".position", c.unit, q_[size_t(c.q)]);
      add(c.name + ".velocity", c.rate_unit, v_[size_t(c.v)]);
      continue;
    }
    const auto* beside = block_beside(m, c);
    if (c.kind == phs::BlockKind::rotation) {
      add_three(c.joint + ".attitude", "rad", {NAN, NAN, NAN});
      add_three(c.joint + ".angular_velocity", "rad/s", three(v_, c.v));
    } else {
      const auto xi = mechanics::Quaternion<double>::load(&q_[size_t(beside->q)]);
      add_three(c.joint + ".position", "m", three(q_, c.q));
      add_three(c.joint + ".linear_velocity", "m/s",
                mechanics::rotation_matrix(xi) * three(v_, c.v));
    }
  }
}

/// A turn δ of a body in its own axes changes ξ by ξ∘δ/2 and, with the velocity kept in the axes of
/// the parent, the velocity in its own by -δ×v.
void Inputs::add_start_slopes(std::span<const double> q, std::span<const double> v,
                              std::vector<double>& to) const {
  const auto add_three = [&](const Vec3d& a) {
    for (int k = 0; k < 3; ++k) to.push_back(a[k]);
  };
  for (const auto& c : assembly_.mechanism->coordinates()) {
    if (c.nv == 1) {
      to.push_back(q[size_t(c.q)]);
      to.push_back(v[size_t(c.v)]);
      continue;
    }
    const auto* beside = block_beside(*assembly_.mechanism, c);
    if (c.kind == phs::BlockKind::rotation) {
      const auto xi = mechanics::Quaternion<double>::load(&q_[size_t(c.q)]),
                 g = mechanics::Quaternion<double>::load(&q[size_t(c.q)]);
      Vec3d turn = 0.5 * (xi.conj() * g).v;
      if (beside) turn += cross(three(v, beside->v), three(v_, beside->v));
      add_three(turn);
      add_three(three(v, c.v));
    } else {
      const auto xi = mechanics::Quaternion<double>::load(&q_[size_t(beside->q)]);
      add_three(three(q, c.q));
      add_three(mechanics::rotation_matrix(xi) * three(v, c.v));
    }
  }
}

std::vector<double> Inputs::slopes(std::span<const double> lambda,
                                   std::span<const double> parameters) const {
  const auto start =
      mechanics::start_in_rates(*assembly_.mechanism, q_, v_, lambda.first(2 * q_.size()));
  std::vector<double> theta(parameters.begin(), parameters.end()), all;
  for (size_t i = 0; i < std::min(theta.size(), start.parameters.size()); ++i)
    theta[i] += start.parameters[i];
  size_t at = 0;
  for (const auto* body : bodies_) {
    in_central_numbers(*body, &theta[at], all);
    at += of_body;
  }
  all.insert(all.end(), theta.begin() + std::ptrdiff_t(at), theta.end());
  add_start_slopes(start.q, start.v, all);
  return all;
}

}  // namespace porthos::scene
