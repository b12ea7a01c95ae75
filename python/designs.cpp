// The matched designs: classical underactuated systems with their controllers.
#include <pybind11/stl.h>

#include "energy_shaping/matching/designs.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

namespace es = energy_shaping;
using py::arg;
using ModelPtr = std::shared_ptr<const phs::Model>;

std::shared_ptr<es::MatchedLoop> made(const es::LoopPtr& l) {
  return std::const_pointer_cast<es::MatchedLoop>(l);
}
std::shared_ptr<phs::Model> made(const es::PlantPtr& p) {
  return std::const_pointer_cast<phs::Model>(p);
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_designs(py::module_& m) {
  const py::object none = py::none();
  py::class_<es::InertiaWheelPendulum>(m, "InertiaWheelPendulum",
                                       "q1 the pendulum from upright, q2 the wheel in the world "
                                       "[rad]: M = diag(I1, I2), V = m3 cos q1. "
                                       "Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002.")
      .def(from_keywords<es::InertiaWheelPendulum>())
      .def_readwrite("I1", &es::InertiaWheelPendulum::I1,
                     "Of the pendulum about its pivot with the wheel's mass at its axis, J + m_w "
                     "l_w² [kg m²].")
      .def_readwrite("I2", &es::InertiaWheelPendulum::I2, "Of the wheel about its axis [kg m²].")
      .def_readwrite(
          "m3", &es::InertiaWheelPendulum::m3,
          "No mass: m g l of pendulum and wheel, the torque of gravity when level [N m].")
      .def_readwrite("a1", &es::InertiaWheelPendulum::a1, "M_d = [[a1, a2], [a2, a3]].")
      .def_readwrite("a2", &es::InertiaWheelPendulum::a2, "See a1.")
      .def_readwrite("a3", &es::InertiaWheelPendulum::a3, "See a1.")
      .def_readwrite("k1", &es::InertiaWheelPendulum::k1,
                     "Of ½ z² in V_d, z = q2 - I1 (a2 + a3)/(I2 (a1 + a2)) q1.")
      .def_readwrite("kv", &es::InertiaWheelPendulum::kv, "Damping injected, -kv Gᵀ ∂H_d/∂p.");
  py::class_<es::BallAndBeam>(m, "BallAndBeam",
                              "q1 the ball from the middle [m], q2 the beam [rad]: "
                              "M = diag(1, L² + q1²), V = g q1 sin q2, of a ball of 1 kg. "
                              "Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002, section VI.")
      .def(from_keywords<es::BallAndBeam>())
      .def_readwrite(
          "L", &es::BallAndBeam::L,
          "√(J/m), J of beam and ball about the hinge, the ball there, m of the ball [m].")
      .def_readwrite("g", &es::BallAndBeam::g,
                     "Acceleration of gravity along the beam when upright [m/s²].")
      .def_readwrite("kp", &es::BallAndBeam::kp, "Of ½ z² in V_d, z = q2 - asinh(q1/L)/√2.")
      .def_readwrite("kv", &es::BallAndBeam::kv, "Damping injected, -kv Gᵀ ∂H_d/∂p.");
  py::class_<es::CartPole>(m, "CartPole",
                           "q1 the pole from upright [rad], q2 the cart [m], whose acceleration u "
                           "is the input: q1'' = a sin q1 - b cos q1 u. "
                           "Source: Acosta, Ortega, Astolfi, Mahindrakar 2005, section IV.")
      .def(from_keywords<es::CartPole>())
      .def_readwrite("a", &es::CartPole::a,
                     "m g l/J of the pole, J about its hinge; of a point mass g/l [1/s²].")
      .def_readwrite("b", &es::CartPole::b, "m l/J of the pole; of a point mass 1/l [1/m].")
      .def_readwrite("k", &es::CartPole::k, "Scale of M_d, and 1/k of the pole's part of V_d.")
      .def_readwrite("m22", &es::CartPole::m22, "The constant part of (M_d)_22 = k cos q1 + m22.")
      .def_readwrite("P", &es::CartPole::P, "Of ½ z² in V_d, z = q2 - q2_rest + a function of q1.")
      .def_readwrite("kv", &es::CartPole::kv, "Damping injected, -kv Gᵀ ∂H_d/∂p.")
      .def_readwrite("q2_rest", &es::CartPole::q2_rest, "Where the cart is to stop [m].");
  py::class_<es::Acrobot>(m, "Acrobot",
                          "q1 the shoulder from upright, q2 the elbow [rad]: M = [[c1 + c2 + 2 c3 "
                          "cos q2, c2 + c3 cos q2], "
                          "[., c2]], V = g (c4 cos q1 + c5 cos(q1 + q2)). Source: Mahindrakar, "
                          "Astolfi, Ortega, Viola 2006.")
      .def(from_keywords<es::Acrobot>())
      .def_static("of", &es::Acrobot::of, arg("plant"), arg("g") = 9.81,
                  "The numbers of the dynamics read off a plant with coordinates (shoulder from "
                  "upright, elbow).")
      .def_readwrite(
          "c1", &es::Acrobot::c1,
          "J1 + m1 lc1² + m2 l1² about the shoulder [kg m²]; l1: from shoulder to elbow.")
      .def_readwrite(
          "c2", &es::Acrobot::c2,
          "J2 + m2 lc2² about the elbow [kg m²]; lc2: from the elbow to the centre of mass.")
      .def_readwrite("c3", &es::Acrobot::c3, "m2 l1 lc2 [kg m²].")
      .def_readwrite("c4", &es::Acrobot::c4,
                     "m1 lc1 + m2 l1 [kg m]; lc1: from the shoulder to the centre of mass.")
      .def_readwrite("c5", &es::Acrobot::c5, "m2 lc2 [kg m].")
      .def_readwrite("g", &es::Acrobot::g, "Acceleration of gravity [m/s²].")
      .def_readwrite("a2", &es::Acrobot::a2, "M_d = [[k a2, a2], [a2, a3]], k = 1 - √(c1/c2).")
      .def_readwrite("a3", &es::Acrobot::a3, "See a2.")
      .def_readwrite("ku", &es::Acrobot::ku, "Of ½ z² in V_d, z = q2 + (1 + √(c1/c2)) q1.")
      .def_readwrite("kv", &es::Acrobot::kv, "Damping injected, -kv Gᵀ ∂H_d/∂p.");
  m.def(
      "inertia_wheel_pendulum",
      [](const es::InertiaWheelPendulum& d, ModelPtr plant) {
        return made(es::inertia_wheel_pendulum(d, std::move(plant)));
      },
      arg("design") = es::InertiaWheelPendulum{}, arg("plant") = none,
      "Pendulum from upright with a reaction wheel. plant: another one to match the law to, else "
      "the design's own.");
  m.def(
      "inertia_wheel_gains", &es::inertia_wheel_gains, arg("design"), arg("bandwidth"),
      arg("damping_ratio") = 1.0,
      "The design with the gains by which the linearised loop has twice the poles of s² + 2ζω s + "
      "ω²; bandwidth ω [rad/s].");
  m.def(
      "ball_and_beam",
      [](const es::BallAndBeam& d, ModelPtr plant) {
        return made(es::ball_and_beam(d, std::move(plant)));
      },
      arg("design") = es::BallAndBeam{}, arg("plant") = none);
  m.def(
      "cart_pole",
      [](const es::CartPole& d, ModelPtr plant) {
        return made(es::cart_pole(d, std::move(plant)));
      },
      arg("design") = es::CartPole{}, arg("plant") = none,
      "After partial feedback linearisation; the pole within 90 degrees of upright.");
  m.def(
      "acrobot",
      [](const es::Acrobot& d, ModelPtr plant, const std::string& port) {
        return made(es::acrobot(d, std::move(plant), {}, port));
      },
      arg("design") = es::Acrobot{}, arg("plant") = none, arg("elbow_port") = "elbow.force");
  m.def(
      "inertia_wheel_plant",
      [](const es::InertiaWheelPendulum& d) { return made(es::inertia_wheel_plant(d)); },
      arg("design") = es::InertiaWheelPendulum{});
  m.def(
      "ball_and_beam_plant",
      [](const es::BallAndBeam& d) { return made(es::ball_and_beam_plant(d)); },
      arg("design") = es::BallAndBeam{});
  m.def(
      "cart_pole_plant", [](const es::CartPole& d) { return made(es::cart_pole_plant(d)); },
      arg("design") = es::CartPole{});
  m.def(
      "acrobot_plant", [](const es::Acrobot& d) { return made(es::acrobot_plant(d)); },
      arg("design") = es::Acrobot{});
}

}  // namespace porthos::python
