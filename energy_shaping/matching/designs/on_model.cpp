#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/matching/design_on_model.h"
#include "energy_shaping/matching/designs/require.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"

/// The numbers of the designs, read off mechanisms. What they leave out (other terms of M or V,
/// springs, friction) shows in the comparison of the motions.
namespace porthos::energy_shaping {
namespace {

using std::numbers::pi;

/// M and V of a mechanism of two joints, the driven one d and the other one o, about q*.
class TwoJoints {
 public:
  TwoJoints(const ModelPtr& model, const DesignJoints& joints)
      : m_(model->mechanism()), w_(m_), rest_(joints.rest) {
    phs::refuse_constraints(model->description(), "IDA-PBC");
    const auto& c = m_.coordinates();
    if (c.size() != 2 || c[0].nq != 1 || c[1].nq != 1)
      throw InvalidArgument("'" + model->description().name + "' has " + std::to_string(m_.nv()) +
                            " degrees of freedom, expected two joints of one each");
    require_size("rest", rest_.size(), 2);
    d = size_t(port_offsets(model->description(), {joints.driven})[0]);
    o = 1 - d;
  }
  /// V with the joints away from q*.
  double V(double other, double driven) {
    return mechanics::potential_energy<double>(m_, w_, at(other, driven));
  }
  /// An entry of M there.
  double M(size_t i, size_t j, double other = 0, double driven = 0) {
    std::vector<double> mass(4);
    mechanics::crba<double>(m_, w_, at(other, driven), mass);
    return mass[2 * j + i];
  }
  /// The torque amplitude of gravity at joint o, negative where q* hangs.
  /// @throws InvalidArgument naming the likely cause, for a rest that is not the upright
  double upright(const char* design) {
    const double amplitude = 0.5 * (V(0, 0) - V(pi, 0));
    double scale = 1e-300;
    for (const double driven : {0.0, pi / 2, pi})
      scale = std::fmax(scale, std::fabs(V(pi / 2, driven) - V(0, 0)));
    const std::string other = m_.coordinates()[o].joint, own = m_.coordinates()[d].joint;
    if (std::fabs(amplitude) <= 1e-9 * scale || amplitude == 0)
      throw InvalidArgument(fmt::format(
          "design '{}' does not apply: gravity does not act at '{}', the joint without actuator, "
          "expected the pendulum there; likely cause: drives = \"{}\", which may be \"{}\"",
          design, other, own, other));
    const double aside = 0.5 * (V(pi / 2, 0) - V(-pi / 2, 0));
    const double lean = std::atan2(aside, amplitude);  // of the upright, seen from the target
    if (std::fabs(lean) > 1e-9) {                      // the comparison of the motions sees less
      const double up = std::remainder(rest_[o] + lean, 2 * pi);
      throw InvalidArgument(fmt::format(
          "design '{}' does not apply: '{}' {} at its target, expected the upright; likely cause: "
          "the target of '{}' is {:.6g} rad, which may be {:.16g}",
          design, other,
          amplitude < 0 ? "hangs" : fmt::format("leans by {:.3g} rad", std::fabs(lean)), other,
          rest_[o], up < -pi + 1e-9 ? up + 2 * pi : up));
    }
    return amplitude;
  }
  /// @throws InvalidArgument for two hinges whose axes are not parallel
  void parallel(const char* design) {
    const auto& c = m_.coordinates();
    std::array<double, 12> J{};
    const auto& last = *std::ranges::max_element(m_.bodies(), {}, &mechanics::BodyFrame::node);
    mechanics::jacobian<double>(m_, w_, rest_, last, mechanics::JacobianAxes::world, J);
    const mechanics::Vec3d a{J[0], J[1], J[2]}, b{J[6], J[7], J[8]};
    const double sine = mechanics::norm(cross(a, b));
    if (sine > 1e-3)  // the comparison of the motions sees less
      throw InvalidArgument(fmt::format(
          "design '{}' does not apply: the axes of '{}' and '{}' are {:.4g} rad apart, "
          "expected parallel ones; a rotary pendulum is for swing_up and lqr, or Python's "
          "numerical_matching",
          design, c[d].joint, c[o].joint, std::atan2(sine, std::fabs(mechanics::dot(a, b)))));
  }
  /// Gravity of an unbalanced wheel is none of the design's.
  /// @throws InvalidArgument naming the likely cause
  void balanced(const char* design) {
    const double pull = 0.5 * std::hypot(V(0, 0) - V(0, pi), V(0, pi / 2) - V(0, -pi / 2));
    if (pull > 0.5e-9 * std::fabs(V(0, 0) - V(pi, 0)))  // the comparison of the motions sees less
      throw InvalidArgument(fmt::format(
          "design '{}' does not apply: gravity pulls at '{}' by up to {:.4g} N m; likely cause: "
          "the wheel's centre of mass is off its axis; balance it in the model, or take an lqr",
          design, m_.coordinates()[d].joint, pull));
  }
  double gravity() const { return mechanics::norm(m_.gravity()); }

  size_t d, o;

 private:
  std::vector<double> at(double other, double driven) const {
    auto q = rest_;
    q[o] += other;
    q[d] += driven;
    return q;
  }
  const mechanics::Mechanism& m_;
  mechanics::Workspace<double> w_;
  std::vector<double> rest_;
};

/// The design's first coordinate is that of joint o, with a sign, the second that of d.
DesignMap ordered(const TwoJoints& j, double sign_o = 1, double sign_d = 1) {
  DesignMap map{{{0, 0}, {0, 0}}, false, 1};
  map.A[0][j.o] = sign_o;
  map.A[1][j.d] = sign_d;
  return map;
}

}  // namespace

DesignOnModel cart_pole_on(ModelPtr model, const DesignJoints& joints, CartPole c) {
  TwoJoints j(model, joints);
  const double inertia = j.M(j.o, j.o), coupling = j.M(j.o, j.d);
  c.a = j.upright("cart-pole") / inertia;  // q'' = a sin q - b cos q u
  c.b = std::fabs(coupling) / inertia;
  c.q2_rest = 0;
  auto map = ordered(j, coupling < 0 ? -1 : 1);
  map.accelerated = true;
  map.numbers = {{"a", c.a, "m g l/J of the pole [1/s²]"}, {"b", c.b, "m l/J of the pole [1/m]"}};
  return {model, cart_pole(c), map, joints};
}

DesignOnModel acrobot_on(ModelPtr model, const DesignJoints& joints, Acrobot a) {
  TwoJoints j(model, joints);
  const Requirement need("acrobot (constant M_d)");
  need(j.o == 0, "the elbow driven, the second joint", {double(j.d)});
  const double stretched = j.M(0, 0), folded = j.M(0, 0, 0, pi);
  a.g = j.gravity();
  a.c2 = j.M(1, 1);
  a.c3 = 0.25 * (stretched - folded);
  a.c1 = 0.5 * (stretched + folded) - a.c2;
  const double both = 0.5 * (j.V(0, 0) - j.V(pi, 0)),
               difference = 0.5 * (j.V(0, pi) - j.V(pi, pi));  // of an elbow that is folded
  a.c4 = 0.5 * (both + difference) / a.g;
  a.c5 = 0.5 * (both - difference) / a.g;
  // With axes of opposite signs the elbow's angle counts the other way; c3 cos q2 cancels in the
  // sum.
  auto map = ordered(j, 1, j.M(0, 1) + j.M(0, 1, 0, pi) < 0 ? -1 : 1);
  map.scale = map.A[1][j.d];
  map.numbers = {{"c1", a.c1, "J1 + m1 lc1² + m2 l1² about the shoulder [kg m²]"},
                 {"c2", a.c2, "J2 + m2 lc2² about the elbow [kg m²]"},
                 {"c3", a.c3, "m2 l1 lc2 [kg m²]"},
                 {"c4", a.c4, "m1 lc1 + m2 l1 [kg m]"},
                 {"c5", a.c5, "m2 lc2 [kg m]"}};
  return {model, acrobot(a), map, joints};
}

namespace {

template <class Gains>
DesignOnModel wheel_on(const ModelPtr& model, const DesignJoints& joints, Gains gains) {
  TwoJoints j(model, joints);
  j.parallel("inertia-wheel pendulum");
  InertiaWheelPendulum w;
  w.I2 = j.M(j.d, j.d);
  w.I1 = j.M(j.o, j.o) - w.I2;
  j.balanced("inertia-wheel pendulum");
  w.m3 = j.upright("inertia-wheel pendulum");
  auto map = ordered(j, 1, j.M(j.o, j.d) < 0 ? -1 : 1);
  map.A[1][j.o] = 1;  // the wheel's angle in the world
  map.scale = map.A[1][j.d];
  map.numbers = {{"I1", w.I1, "of the pendulum with the wheel's mass at its axis [kg m²]"},
                 {"I2", w.I2, "of the wheel about its axis [kg m²]"},
                 {"m3", w.m3, "m g l of pendulum and wheel [N m]"}};
  return {model, inertia_wheel_pendulum(gains(w)), map, joints};
}

}  // namespace

DesignOnModel inertia_wheel_on(ModelPtr model, const DesignJoints& joints, InertiaWheelPendulum d) {
  return wheel_on(model, joints, [&d](InertiaWheelPendulum w) {
    w.a1 = d.a1;
    w.a2 = d.a2;
    w.a3 = d.a3;
    w.k1 = d.k1;
    w.kv = d.kv;
    return w;
  });
}

DesignOnModel inertia_wheel_on(ModelPtr model, const DesignJoints& joints, double bandwidth,
                               double damping_ratio) {
  return wheel_on(model, joints, [&](const InertiaWheelPendulum& w) {
    return inertia_wheel_gains(w, bandwidth, damping_ratio);
  });
}

DesignOnModel ball_and_beam_on(ModelPtr model, const DesignJoints& joints, BallAndBeam b) {
  TwoJoints j(model, joints);
  const double mass = j.M(j.o, j.o), weight = 0.5 * (j.V(1, pi / 2) - j.V(-1, pi / 2));
  b.L = std::sqrt(j.M(j.d, j.d) / mass);
  b.g = std::fabs(weight) / mass;
  auto map = ordered(j, 1, weight < 0 ? -1 : 1);
  map.scale = mass * map.A[1][j.d];
  map.numbers = {{"L", b.L, "√(J/m), J of beam and ball about the hinge [m]"},
                 {"g", b.g, "acceleration of gravity along the beam when upright [m/s²]"}};
  return {model, ball_and_beam(b), map, joints};
}

}  // namespace porthos::energy_shaping
