#pragma once
#include <cmath>
#include <memory>

#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "phs/network/elements.h"
#include "phs/scalars/quad.h"
#include "phs/system/user_model.h"
#include "vsa/actuator.h"
#include "vsa/catalogue.h"
#include "vsa/families.h"

namespace porthos::test {

/// The corrected model of the variable-stiffness joint, written by hand: x = (ql, qm, th, pl, pm,
/// pth),
///   H = pl²/2Il + pm²/2Im + pth²/2Ith + ½ k(th) (qm - ql)² + V(ql),   k = 20 + 60 th + 120 th²,
///   V = -g cos ql,
/// with dampers on all three and torques on motor and stiffness motor.
struct SixStates {
  double Il = 0.5, Im = 0.3, Ith = 0.5, g = 4.0, c[3] = {20, 60, 120};
  double damping[3] = {0.02, 0.05, 0.4};
  double torque = 1.5, push = 0.6;  ///< amplitudes
  bool driven = true;
  double hold = 0;  ///< a spring on th [N m/rad]

  phs::Description description() const {
    phs::Description d;
    d.name = "six states";
    d.nx = 6;
    d.traits = {.autonomous = !driven, .canonical = true, .lossless = !driven};
    d.blocks = {{"ql", phs::BlockKind::linear, 0, 1, 3, "rad", "N m s"},
                {"qm", phs::BlockKind::linear, 1, 1, 4, "rad", "N m s"},
                {"th", phs::BlockKind::linear, 2, 1, 5, "rad", "N m s"}};
    d.powers = {{"dampers", phs::PowerKind::dissipated},
                {"motor", phs::PowerKind::supplied},
                {"stiffness", phs::PowerKind::supplied}};
    return d;
  }
  template <class T>
  T k(T th) const {
    return T(c[0]) + th * (T(c[1]) + th * T(c[2]));
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T phi = x[1] - x[0];
    return T(0.5 / Il) * x[3] * x[3] + T(0.5 / Im) * x[4] * x[4] + T(0.5 / Ith) * x[5] * x[5] +
           T(0.5) * k(x[2]) * phi * phi - T(g) * phs::cos(x[0]) + T(0.5 * hold) * x[2] * x[2];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    const T phi = x[1] - x[0], force = k(x[2]) * phi;
    e[0] = T(g) * phs::sin(x[0]) - force;
    e[1] = force;
    e[2] = T(0.5) * (T(c[1]) + T(2 * c[2]) * x[2]) * phi * phi + T(hold) * x[2];
    e[3] = x[3] / T(Il);
    e[4] = x[4] / T(Im);
    e[5] = x[5] / T(Ith);
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    for (size_t i = 0; i < 3; ++i) {
      Re[i] = T(0.0);
      Re[3 + i] = T(driven ? damping[i] : 0.0) * e[3 + i];
    }
  }
  template <class T>
  T motor(T t) const {
    return T(driven ? torque : 0) * phs::sin(T(0.7) * t);
  }
  template <class T>
  T stiffener(T t) const {
    return T(driven ? push : 0) * phs::sin(T(1.1) * t);
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[4] = dx[4] + motor(t);
    dx[5] = dx[5] + stiffener(t);
  }
  template <class T>
  void powers(T t, std::span<const T>, std::span<const T> e, std::span<T> values) const {
    values[0] = T(0.0);
    for (size_t i = 0; i < 3; ++i)
      values[0] = values[0] + T(driven ? damping[i] : 0) * e[3 + i] * e[3 + i];
    values[1] = motor(t) * e[4];
    values[2] = stiffener(t) * e[5];
  }
};

/// The textbook's four states: k is turned by a signal th(t) and nothing asks what that takes. The
/// true power of it, ½ k' φ² th', is put down under a name of its own and not among what is
/// supplied.
struct FourStates : SixStates {
  double amplitude = 0.3;
  phs::Description description() const {
    phs::Description d;
    d.name = "four states";
    d.nx = 4;
    d.traits = {.autonomous = false, .canonical = true, .lossless = true};
    d.blocks = {{"ql", phs::BlockKind::linear, 0, 1, 2, "rad", "N m s"},
                {"qm", phs::BlockKind::linear, 1, 1, 3, "rad", "N m s"}};
    d.powers = {{"forgotten", phs::PowerKind::supplied}};
    return d;
  }
  template <class T>
  T angle(T t) const {
    return T(amplitude) * phs::sin(T(2.0) * t);
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {  // the part that does not depend on time
    return T(0.5 / Il) * x[2] * x[2] + T(0.5 / Im) * x[3] * x[3] - T(g) * phs::cos(x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = T(g) * phs::sin(x[0]);
    e[1] = T(0.0);
    e[2] = x[2] / T(Il);
    e[3] = x[3] / T(Im);
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T>, std::span<T> Re) const {
    for (T& r : Re) r = T(0.0);
  }
  template <class T>
  void drive(T t, std::span<const T> x, std::span<T> dx) const {
    const T force = k(angle(t)) * (x[1] - x[0]);
    dx[2] = dx[2] + force;
    dx[3] = dx[3] - force;
  }
  template <class T>
  void powers(T t, std::span<const T> x, std::span<const T>, std::span<T> values) const {
    const T th = angle(t), phi = x[1] - x[0];
    const T rate = T(2 * amplitude) * phs::cos(T(2.0) * t);
    values[0] = T(0.5) * (T(c[1]) + T(2 * c[2]) * th) * phi * phi * rate;
  }
  /// H of the textbook: with the spring.
  template <class T>
  T textbook(T t, std::span<const T> x) const {
    return hamiltonian(x) + T(0.5) * k(angle(t)) * (x[1] - x[0]) * (x[1] - x[0]);
  }
};

/// A pendulum of some inertia about its hinge with V = -weight cos q.
inline std::shared_ptr<const mechanics::MechanicalModel> pendulum(double inertia, double weight) {
  mechanics::MechanismBuilder b("pendulum");
  b.gravity({0, 0, -2 * weight});
  mechanics::BodySpec s;
  s.name = "link";
  s.parent = "world";
  s.joint.type = "continuous";
  s.joint.name = "hinge";
  s.joint.axis = {0, 1, 0};
  const double own = inertia - 0.25;  // of 1 kg at 0.5 m
  s.mass = {1, {0, 0, -0.5}, {own, 0, 0, own, 0, own}};
  b.add(s);
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

/// The two links of reference case m_sea_2dof: q1 from the downward vertical, q2 relative.
inline std::shared_ptr<const mechanics::MechanicalModel> two_links() {
  mechanics::MechanismBuilder b("two links");
  b.gravity({0, 0, -9.8125});
  const double m[] = {2, 1}, I[] = {0.0625, 0.03125};
  for (size_t i = 0; i < 2; ++i) {
    mechanics::BodySpec s;
    s.name = i ? "lower" : "upper";
    s.parent = i ? "upper" : "world";
    s.joint.type = "continuous";
    s.joint.name = i ? "elbow" : "shoulder";
    s.joint.axis = {0, 1, 0};
    if (i) s.placement.r = {0, 0, -0.5};
    s.mass = {m[i], {0, 0, -0.25}, {I[i], 0, 0, I[i], 0, I[i]}};
    b.add(s);
  }
  return std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
}

/// The state of a network of a mechanism and its actuators.
inline phs::State state_of(
    const phs::NetworkModel& n, const std::vector<double>& mechanism,
    const std::vector<std::pair<std::string, std::vector<double>>>& actuators) {
  std::vector<double> x(size_t(n.description().nx), 0.0);
  std::copy(mechanism.begin(), mechanism.end(), x.begin() + n.offset("mechanism"));
  for (const auto& [name, start] : actuators)
    std::copy(start.begin(), start.end(), x.begin() + n.offset(name));
  return phs::State(n.description(), x);
}

}  // namespace porthos::test
