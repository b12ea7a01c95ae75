// The matched designs: classical underactuated systems with their controllers.
#include <pybind11/stl.h>

#include "energy_shaping/designs.h"
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
                                       "Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002.")
      .def(from_keywords<es::InertiaWheelPendulum>())
      .def_readwrite("I1", &es::InertiaWheelPendulum::I1)
      .def_readwrite("I2", &es::InertiaWheelPendulum::I2)
      .def_readwrite("m3", &es::InertiaWheelPendulum::m3)
      .def_readwrite("a1", &es::InertiaWheelPendulum::a1)
      .def_readwrite("a2", &es::InertiaWheelPendulum::a2)
      .def_readwrite("a3", &es::InertiaWheelPendulum::a3)
      .def_readwrite("k1", &es::InertiaWheelPendulum::k1)
      .def_readwrite("kv", &es::InertiaWheelPendulum::kv);
  py::class_<es::BallAndBeam>(m, "BallAndBeam",
                              "Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002, section VI.")
      .def(from_keywords<es::BallAndBeam>())
      .def_readwrite("L", &es::BallAndBeam::L)
      .def_readwrite("g", &es::BallAndBeam::g)
      .def_readwrite("kp", &es::BallAndBeam::kp)
      .def_readwrite("kv", &es::BallAndBeam::kv);
  py::class_<es::CartPole>(m, "CartPole",
                           "Source: Acosta, Ortega, Astolfi, Mahindrakar 2005, section IV.")
      .def(from_keywords<es::CartPole>())
      .def_readwrite("a", &es::CartPole::a)
      .def_readwrite("b", &es::CartPole::b)
      .def_readwrite("k", &es::CartPole::k)
      .def_readwrite("m22", &es::CartPole::m22)
      .def_readwrite("P", &es::CartPole::P)
      .def_readwrite("kv", &es::CartPole::kv)
      .def_readwrite("q2_rest", &es::CartPole::q2_rest);
  py::class_<es::Acrobot>(m, "Acrobot", "Source: Mahindrakar, Astolfi, Ortega, Viola 2006.")
      .def(from_keywords<es::Acrobot>())
      .def_static("of", &es::Acrobot::of, arg("plant"), arg("g") = 9.81,
                  "The numbers of the dynamics read off a plant with coordinates (shoulder from "
                  "upright, elbow).")
      .def_readwrite("c1", &es::Acrobot::c1)
      .def_readwrite("c2", &es::Acrobot::c2)
      .def_readwrite("c3", &es::Acrobot::c3)
      .def_readwrite("c4", &es::Acrobot::c4)
      .def_readwrite("c5", &es::Acrobot::c5)
      .def_readwrite("g", &es::Acrobot::g)
      .def_readwrite("a2", &es::Acrobot::a2)
      .def_readwrite("a3", &es::Acrobot::a3)
      .def_readwrite("ku", &es::Acrobot::ku)
      .def_readwrite("kv", &es::Acrobot::kv);
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
