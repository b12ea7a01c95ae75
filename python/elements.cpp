// Laws and systems that terminate or join the ports of a network.
#include "phs/network/elements.h"

#include <pybind11/stl.h>

#include "phs/functions/block_potential.h"
#include "python/bind.h"
#include "python/keywords.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using namespace phs;
using py::arg;

FunctionPtr const_ptr(std::shared_ptr<Function> f) { return f; }
std::shared_ptr<Function> mutable_ptr(const FunctionPtr& f) {
  return std::const_pointer_cast<Function>(f);
}
std::shared_ptr<BlockPotential> mutable_ptr(const BlockPotentialPtr& U) {
  return std::const_pointer_cast<BlockPotential>(U);
}
std::shared_ptr<Model> mutable_ptr(const std::shared_ptr<const Model>& m) {
  return std::const_pointer_cast<Model>(m);
}

Domain domain_of(const std::string& name) {
  if (name == "translation") return translation;
  if (name == "rotation") return rotation;
  if (name == "electricity") return electricity;
  throw InvalidArgument("domain is '" + name +
                        "', expected 'translation', 'rotation' or 'electricity'");
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_elements(py::module_& m) {
  py::class_<Potential>(
      m, "Potential",
      "An energy U(z) with its slope U'(z): a spring, a limit, any potential of one coordinate.")
      .def(py::init([](std::shared_ptr<Function> energy, std::shared_ptr<Function> slope) {
             return Potential{const_ptr(std::move(energy)), const_ptr(std::move(slope))};
           }),
           arg("energy"), arg("slope"));
  m.def(
      "viscous", [](double damping) { return mutable_ptr(viscous(damping)); }, arg("damping"),
      "force = damping rate. Raises InvalidArgument if damping < 0.");
  m.def(
      "friction",
      [](double coulomb, double breakaway, double stribeck, double viscous, double smoothing) {
        return mutable_ptr(friction({coulomb, breakaway, stribeck, viscous, smoothing}));
      },
      py::kw_only(), arg("coulomb") = 0.0, arg("breakaway") = 0.0, arg("stribeck") = 0.0,
      arg("viscous") = 0.0, arg("smoothing") = 0.0,
      R"(Dry friction with the Stribeck effect, made smooth; passive by construction, as force and rate have one sign.

    force = (coulomb + (breakaway - coulomb) exp(-(rate/stribeck)^2)) tanh(rate/smoothing) + viscous rate)");
  m.def("spring", &spring, arg("k"), arg("rest") = 0.0, arg("k3") = 0.0,
        "U = k (z - rest)^2 / 2 + k3 (z - rest)^4 / 4.");
  m.def(
      "tabulated_spring", &tabulated_spring, arg("z"), arg("force"),
      "A force measured at some elongations: a natural cubic spline between them, linear outside.");
  m.def("soft_limits", &soft_limits, arg("lower"), arg("upper"), arg("k"),
        "U = k d^3 / 3, d the depth beyond a limit: nothing is felt between the limits.");
  const py::class_<BlockPotential, std::shared_ptr<BlockPotential>> block(
      m, "BlockPotential", "An energy of a coordinate of several numbers.");
  m.def(
      "attitude_spring",
      [](double stiffness, const std::array<double, 4>& rest) {
        return mutable_ptr(attitude_spring(stiffness, rest));
      },
      arg("stiffness"), arg("rest") = std::array<double, 4>{1, 0, 0, 0},
      R"(U = k (1 - cos theta), theta the angle from the rest attitude (w, x, y, z): torque k sin theta [N m].)");
  m.def(
      "place_spring",
      [](double stiffness, const std::array<double, 3>& rest) {
        return mutable_ptr(place_spring(stiffness, rest));
      },
      arg("stiffness"), arg("rest") = std::array<double, 3>{0, 0, 0}, "U = k |r - rest|^2 / 2.");
  m.def(
      "constant", [](double v) { return mutable_ptr(constant(v)); }, arg("value"));
  m.def(
      "sine",
      [](double a, double f, double phase, double offset) {
        return mutable_ptr(sine(a, f, phase, offset));
      },
      arg("amplitude"), arg("frequency_Hz"), arg("phase") = 0.0, arg("offset") = 0.0,
      "offset + amplitude sin(2 pi frequency t + phase)");
  m.def(
      "profile",
      [](const std::vector<double>& t, const std::vector<double>& v) {
        return mutable_ptr(profile(t, v));
      },
      arg("t"), arg("value"),
      "Values at times, a natural cubic spline between them, the first and last value outside.");
  py::class_<Held>(m, "Held",
                   "A value held until it is set again. One per run: set between steps only.")
      .def(py::init<>())
      .def_property("value", &Held::value, &Held::set)
      .def("signal", [](const Held& h) { return mutable_ptr(h.signal()); });

  m.def(
      "spring_element",
      [](const Potential& p, const std::string& d) {
        return mutable_ptr(spring_element(p, domain_of(d)));
      },
      arg("potential"), arg("domain") = "rotation",
      "State: elongation z, z' = rate. Port 'ends' (flow in): rate -> force U'(z). A capacitor in "
      "the electrical domain.");
  m.def(
      "inertia_element",
      [](double mass, const std::string& d) {
        return mutable_ptr(inertia_element(mass, domain_of(d)));
      },
      arg("mass"), arg("domain") = "rotation",
      "State: momentum p, p' = force. Port 'body' (effort in): force -> rate p/m. An inductor in "
      "the electrical domain.");
  const auto def_motor = [&](const char* name, auto make, const char* text) {
    m.def(
        name,
        [make](double L, double R, double k, double gear, double rotor, double friction) {
          return mutable_ptr(make(DcMotor{L, R, k, gear, rotor, friction}));
        },
        py::kw_only(), arg("inductance"), arg("resistance"), arg("constant"), arg("gear") = 1.0,
        arg("rotor_inertia") = 0.0, arg("friction") = 0.0, text);
  };
  def_motor(
      "dc_motor", dc_motor,
      R"(Direct-current motor with its rotor: torque k i against back-emf k w. States: flux L i [H], momentum of the rotor
seen at the shaft. Ports 'supply' (effort in: V -> A) and 'shaft' (effort in: N m -> rad/s).)");
  def_motor(
      "dc_drive", dc_drive,
      R"(The drive of a rigid gear: no rotor of its own (give gear^2 rotor_inertia to the joint as its rotor inertia). State:
flux. Ports 'supply' and 'shaft' (flow in: rad/s -> the torque against it), for Network.feedback with a joint.)");
}

}  // namespace porthos::python
