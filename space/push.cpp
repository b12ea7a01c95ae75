#include "space/push.h"

#include <cmath>

#include "mechanics/passes-inl.h"
#include "mechanics/rotation.h"
#include "space/gravity_gradient.h"

namespace porthos::space {

using namespace mechanics;

Vec3d magnetic_field(const Planet& planet, const Vec3d& r, double t) {
  if (!planet.magnetic)
    throw InvalidArgument("planet '" + planet.name +
                          "' has no magnetic field, expected [planet] magnetic");
  const MagneticDipole& d = *planet.magnetic;
  const Vec3d& z = planet.axis;
  const Vec3d seed = std::fabs(z.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d x = seed - dot(seed, z) * z;
  x = (1 / norm(x)) * x;
  const Vec3d y = cross(z, x);
  const double angle = d.longitude + planet.rotation_rate.value_or(0) * t;
  const Vec3d k =
      std::cos(d.tilt) * z + std::sin(d.tilt) * (std::cos(angle) * x + std::sin(angle) * y);
  const double size = norm(r), a = planet.radius / size;
  const Vec3d u = (1 / size) * r;
  return (d.equator * a * a * a) * (k - (3 * dot(k, u)) * u);
}

OrbitPush::OrbitPush(const Mechanism& m, const Parts& parts, const Planet& planet)
    : m_(m), on_(m), parts_(parts), planet_(planet) {
  const auto add = [&](const char* kind, const auto& part) {
    const BodyFrame& link = m.body(part.link);
    if (link.node < 0)
      throw InvalidArgument(std::string(kind) + " '" + part.name + "': its link '" + part.link +
                            "' is fixed to the world and never moves");
    place_.push_back(link.pose * Pose{Mat3<double>::identity(), part.position});
    node_.push_back(link.node);
  };
  for (const Thruster& t : parts.thrusters) add("thruster", t);
  for (const Wrench& w : parts.wrenches) add("wrench", w);
  for (const Torquer& t : parts.torquers) {
    if (!planet.magnetic)
      throw InvalidArgument("torquer '" + t.name + "': planet '" + planet.name +
                            "' has no magnetic field, expected [planet] magnetic");
    wheels_.push_back(wheel_axes(m, "torquer '" + t.name + "'", t.wheels));
  }
  pushes_.resize(parts.pushes());
  for (Push& p : pushes_) p.force.assign(size_t(m.nv()), 0.0);
}

void OrbitPush::set_turn_angles(std::span<const double> angles) { on_.set_turn_angles(angles); }

void OrbitPush::evaluate(std::span<const double> x, const Vec3d& R, double t, double when) {
  if (pushes_.empty()) return;
  const auto q = x.first(size_t(m_.nq()));
  for (size_t k = 0; k < parts_.thrusters.size(); ++k) {
    const Thruster& th = parts_.thrusters[k];
    push(k, q, {{0, 0, 0}, (th.thrust * th.schedule.at(when)) * th.direction}, false);
  }
  for (size_t k = 0; k < parts_.wrenches.size(); ++k) {
    const Wrench& w = parts_.wrenches[k];
    push(parts_.thrusters.size() + k, q, {at_time(w.moment, t), at_time(w.force, t)}, w.in_world);
  }
  if (parts_.torquers.empty()) return;
  const auto R_WB = rotation_matrix(Quaternion<double>::load(x.data() + base_attitude));
  const Vec3d field_B = R_WB.tmul(magnetic_field(planet_, R, t));
  for (size_t k = 0; k < parts_.torquers.size(); ++k) {
    Push& push = pushes_[parts_.forces() + k];
    const Vec3d n =
        torque_of<double>(parts_.torquers[k], wheels_[k], t, x, size_t(m_.nq()), field_B);
    for (int c = 0; c < 3; ++c) push.force[size_t(c)] = n[c];  // the base's own freedoms come first
    push.torque = R_WB * n;
  }
}

void OrbitPush::push(size_t k, std::span<const double> q, Force<double> load, bool in_world) {
  Push& push = pushes_[k];
  std::fill(push.force.begin(), push.force.end(), 0.0);
  push.on_centre = push.torque = {0, 0, 0};
  if (dot(load.f, load.f) + dot(load.n, load.n) == 0) return;
  on_.place(q);
  // N: node, with the link's place at X_NL; B: base; W: inertial axes
  const Pose& X_NL = place_[k];
  const size_t at = size_t(node_[k]);
  const auto along = [&](const Vec3d& v) {
    return in_world ? on_.axes(at).tmul(on_.base().tmul(v)) : X_NL.R * v;
  };
  const Vec3d F_N = along(load.f), F_B = on_.axes(at) * F_N;
  const auto& nodes = m_.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Vec3d share = on_.axes(i).tmul((-1 / m_.total_mass()) * F_B);
    on_.wrench(i) += {cross(nodes[i].inertia.mc, share), nodes[i].inertia.m * share};
  }
  on_.wrench(at) += Force<double>{cross(X_NL.r, F_N) + along(load.n), F_N};
  on_.project();
  std::copy(on_.joint_forces().begin(), on_.joint_forces().end(), push.force.begin());
  push.torque = on_.torque();
  push.on_centre = on_.base() * F_B;
}

void OrbitPush::momentum_rates(std::span<const double> q, std::span<const double> joint_forces,
                               std::span<double> p_dot) const {
  for (const Node& n : m_.nodes())
    visit_joint(n.type, [&](auto J) {
      using Joint = decltype(J);
      double out[Joint::nq];
      const double* f = joint_forces.data() + n.v;
      if constexpr (Joint::lifted)
        Joint::lift(q.data() + n.q, f, out);
      else
        for (int c = 0; c < Joint::nv; ++c) out[c] = f[c];
      for (int c = 0; c < Joint::nq; ++c) p_dot[size_t(n.q + c)] += out[c];
    });
}

}  // namespace porthos::space
