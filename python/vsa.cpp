// Variable-stiffness actuators: the families, the catalogue and actuators on the joints of a
// network.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <span>

#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"
#include "vsa/actuator.h"
#include "vsa/catalogue.h"
#include "vsa/formula.h"
#include "vsa/table.h"

namespace porthos::python {
namespace {

using namespace vsa;
using py::arg;
using ElasticHandle = std::shared_ptr<Elastic>;

using SpringNumbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

SpringNumbers spring_numbers(const char* name, const py::object& given) {
  if (auto numbers = SpringNumbers::ensure(given)) return numbers;
  PyErr_Clear();
  throw InvalidArgument(std::string(name) + " is " + kind_of(given) +
                        ", expected a number or an array of numbers");
}

/// f(q, theta, sigma, numbers of the item) for numbers, or for arrays that are broadcast as numpy
/// does: their shape, with that of the item behind it. Of plain numbers the item alone.
template <class F>
py::array_t<double> of_each(const py::object& q, const py::object& theta, const py::object& sigma,
                            const Shape& item, const F& f) {
  const py::tuple all =
      py::module_::import("numpy")
          .attr("broadcast_arrays")(spring_numbers("q", q), spring_numbers("theta", theta),
                                    spring_numbers("sigma", sigma))
          .cast<py::tuple>();
  const auto a = all[0].cast<SpringNumbers>(), b = all[1].cast<SpringNumbers>(),
             c = all[2].cast<SpringNumbers>();
  Shape shape(a.shape(), a.shape() + a.ndim());
  shape.insert(shape.end(), item.begin(), item.end());
  const size_t n = size_of(item);
  std::vector<double> values(size_t(a.size()) * n);
  for (size_t i = 0; i < size_t(a.size()); ++i)
    f(a.data()[i], b.data()[i], c.data()[i], std::span(values).subspan(i * n, n));
  return as_array(std::move(values), shape);
}
/// One number of each: a float of plain numbers.
template <class F>
py::object number_of_each(const py::object& q, const py::object& theta, const py::object& sigma,
                          const F& f) {
  const auto all = of_each(q, theta, sigma, {},
                           [&](double x, double y, double z, auto to) { to[0] = f(x, y, z); });
  return all.ndim() == 0 ? py::object(py::float_(*all.data())) : py::object(all);
}

void bind_elastic(py::module_& m) {
  py::class_<vsa::Limits>(
      m, "Limits",
      "Where deflection and sigma end. Beyond, a stop takes up energy as well; nothing is clipped.")
      .def(from_keywords<vsa::Limits>())
      .def_readwrite("deflection", &vsa::Limits::deflection, "[rad], > 0")
      .def_readwrite("stop_stiffness", &vsa::Limits::stop_stiffness,
                     "[N m/rad^2] where deflection is given, > 0")
      .def_readwrite("sigma_lower", &vsa::Limits::sigma_lower)
      .def_readwrite("sigma_upper", &vsa::Limits::sigma_upper)
      .def_readwrite("sigma_stop_stiffness", &vsa::Limits::sigma_stop_stiffness, "[J/sigma^3]");
  py::class_<Elastic, ElasticHandle>(
      m, "Elastic",
      "The elastic energy E(q, theta, sigma) of an actuator: q link angle, theta the motor's "
      "equilibrium angle, sigma what sets the stiffness: numbers, or arrays that numpy broadcasts.")
      .def_property_readonly("family", [](const Elastic& e) { return e.traits().family; })
      .def_property_readonly("title", [](const Elastic& e) { return e.traits().title; })
      .def_property_readonly(
          "sigma", [](const Elastic& e) { return e.traits().sigma; },
          "What sigma is; empty: the energy does not depend on it.")
      .def_property_readonly("sigma_unit", [](const Elastic& e) { return e.traits().sigma_unit; })
      .def_property_readonly("limits", [](const Elastic& e) { return e.traits().limits; })
      .def_property_readonly(
          "remark", [](const Elastic& e) { return e.traits().remark; },
          "What costs its users accuracy, as a stiffness that jumps; empty: nothing known.")
      .def_property_readonly(
          "loop", &vsa::measured_loop,
          "Of a measured spring the width of the loop of its rows, loading above "
          "unloading [N m]; 0: none that is told from noise.")
      .def(
          "energy",
          [](const Elastic& e, const py::object& q, const py::object& theta,
             const py::object& sigma) {
            return number_of_each(q, theta, sigma,
                                  [&](double x, double y, double z) { return e.energy(x, y, z); });
          },
          arg("q"), arg("theta"), arg("sigma") = 0.0, "E [J]: a float, or an array of their shape")
      .def(
          "slopes",
          [](const Elastic& e, const py::object& q, const py::object& theta,
             const py::object& sigma) {
            const auto slope = [&](double Slopes<double>::*of) {
              return number_of_each(q, theta, sigma, [&](double x, double y, double z) {
                return e.slopes(x, y, z).*of;
              });
            };
            return py::make_tuple(slope(&Slopes<double>::q), slope(&Slopes<double>::theta),
                                  slope(&Slopes<double>::sigma));
          },
          arg("q"), arg("theta"), arg("sigma") = 0.0,
          "dE/d(q, theta, sigma): efforts a motion has to bring up; what the spring does is their "
          "negative.")
      .def(
          "stiffness",
          [](const Elastic& e, const py::object& q, const py::object& theta,
             const py::object& sigma) {
            return number_of_each(q, theta, sigma, [&](double x, double y, double z) {
              return e.stiffness(x, y, z);
            });
          },
          arg("q"), arg("theta"), arg("sigma") = 0.0,
          "d2E/dq2 [N m/rad]: a float, or an array of their shape")
      .def(
          "hessian",
          [](const Elastic& e, const py::object& q, const py::object& theta,
             const py::object& sigma) {
            return of_each(q, theta, sigma, {3, 3}, [&](double x, double y, double z, auto to) {
              auto at = to.begin();
              for (const auto& row : e.hessian(x, y, z)) at = std::ranges::copy(row, at).out;
            });
          },
          arg("q"), arg("theta"), arg("sigma") = 0.0,
          "Second derivatives, rows and columns (q, theta, sigma): (..., 3, 3).");
}

void bind_families(py::module_& m) {
  m.def(
      "families",
      [] {
        py::dict all;
        for (const auto& f : families()) {
          py::dict keys;
          for (const auto& k : f.keys)
            keys[py::str(k.name)] = k.unit + (k.optional ? " (optional)" : "");
          all[py::str(f.name)] = keys;
        }
        return all;
      },
      "{family: {parameter: unit}}");
  m.def(
      "make_elastic",
      [](const std::string& family, const vsa::Limits& limits, const py::kwargs& parameters) {
        Values v;
        for (const auto& [key, value] : parameters) {
          const auto name = key.cast<std::string>();
          const bool several =
              (py::isinstance<py::sequence>(value) || py::isinstance<py::array>(value)) &&
              !py::isinstance<py::str>(value);
          v[name] = several ? numbers(name.c_str(), value, py::len(value))
                            : std::vector<double>{number(name, value)};
        }
        return std::const_pointer_cast<Elastic>(make_elastic(family, v, limits));
      },
      arg("family"), arg("limits") = vsa::Limits{},
      "A member of a family; parameters by name, see families().");
  m.def(
      "table",
      [](const std::string& csv_file, double smoothing, const vsa::Limits& limits,
         double relative_smoothing) {
        const vsa::TorqueErrors errors{smoothing, relative_smoothing};
        const auto rows = vsa::read_measurements(csv_file, errors);
        auto spring = std::const_pointer_cast<Elastic>(vsa::tabulated(rows, limits, 0.02, errors));
        if (!rows.remark.empty() && PyErr_WarnEx(PyExc_UserWarning, rows.remark.c_str(), 1) != 0)
          throw py::error_already_set();
        return spring;
      },
      arg("csv_file"), arg("smoothing") = 0.0, arg("limits") = vsa::Limits{},
      arg("relative_smoothing") = 0.0,
      R"(A measured spring, from a CSV file as the key table of an [[actuator]]: docs/tutorials/actuator.md.

csv_file: columns deflection [rad], torque [N m] and, where measured, sigma, stiffness [N m/rad] and sigma_effort.
smoothing: standard deviation of the errors of the torques [N m]; more than 0: places need be no grid and may be repeated.
relative_smoothing: the same as a share of each torque, as 0.03. Warns of torques that scatter more than stated, or less.
limits: where none are given for sigma, it has the range of the file. InvalidArgument with file and line: it fits no energy.)");
  m.def(
      "formula",
      [](const py::object& energy, const vsa::Limits& limits, const py::kwargs& parameters) {
        const py::object text =
            py::isinstance<py::str>(energy)
                ? energy
                : py::module_::import("porthos.formulas").attr("energy_of")(energy);
        std::map<std::string, double> values;
        for (const auto& [key, value] : parameters) {
          const auto name = key.cast<std::string>();
          values[name] = number(name, value);
        }
        return std::const_pointer_cast<Elastic>(
            formula({text.cast<std::string>(), std::move(values)}, limits));
      },
      arg("energy"), arg("limits") = vsa::Limits{},
      R"(An elastic energy [J] of your own, of the deflection phi = q - theta [rad] and the stiffness setting sigma.

energy: a text as "0.5*(k0 + k1*sigma^2)*phi^2", whose further names are the parameters, by name; or a function of (phi) or
(phi, sigma), which is called once, now, and written down as such a text: it may use + - * / **, abs and numpy's functions, no
comparisons. Torque, stiffness and the effort of sigma are exact derivatives of it. The text is the title of the result.

limits: where it holds. The range of sigma is required if the energy depends on it; the deflection goes to its limit, or to pi.
There it has to be finite with a stiffness of 0 or more; else InvalidArgument. TypeError: the function is no formula.)");
}

void bind_catalogue(py::module_& m) {
  py::class_<vsa::Quantity>(m, "Quantity", "A number and where it comes from.")
      .def_readonly("name", &vsa::Quantity::name)
      .def_readonly("value", &vsa::Quantity::value)
      .def_readonly("unit", &vsa::Quantity::unit)
      .def_property_readonly(
          "provenance", [](const vsa::Quantity& q) { return std::string(to_string(q.provenance)); },
          "published, derived, from memory (unverified: do not use in design) or illustrative")
      .def_readonly("source", &vsa::Quantity::source);
  py::class_<Device>(m, "Device", "A device of the catalogue: docs/actuators.md.")
      .def_readonly("name", &Device::name)
      .def_readonly("title", &Device::title)
      .def_readonly("family", &Device::family, "Empty: no model, its parameters are not public.")
      .def_readonly("parameters", &Device::parameters)
      .def_readonly("datasheet", &Device::datasheet)
      .def_readonly("limits", &Device::limits)
      .def_readonly("remark", &Device::remark)
      .def("__repr__",
           [](const Device& d) { return fmt::format("<porthos.vsa.Device '{}'>", d.name); });
  m.def("devices", &devices);
  m.def("device", &device, arg("name"),
        "InvalidArgument for an unknown name lists the known ones.");
  m.def(
      "elastic_of", [](const Device& d) { return std::const_pointer_cast<Elastic>(elastic_of(d)); },
      arg("device"), "InvalidArgument for a device without a model.");
}

void bind_actuator(py::module_& m) {
  py::class_<Drive> drive(m, "Drive", "What moves theta or sigma.");
  py::enum_<Drive::Kind>(drive, "Kind")
      .value("fixed", Drive::Kind::fixed)
      .value("torque", Drive::Kind::torque)
      .value("position", Drive::Kind::position)
      .value("rate", Drive::Kind::rate)
      .value("servo", Drive::Kind::servo);
  const auto function = [](phs::FunctionPtr Drive::*member) {
    return [member](const Drive& d) { return std::const_pointer_cast<phs::Function>(d.*member); };
  };
  const auto set_function = [](phs::FunctionPtr Drive::*member) {
    return [member](Drive& d, std::shared_ptr<phs::Function> f) { d.*member = std::move(f); };
  };
  drive.def(from_keywords<Drive>())
      .def_readwrite("kind", &Drive::kind)
      .def_readwrite("inertia", &Drive::inertia,
                     "Of torque, position: J on the rotor's side [kg m^2], > 0.")
      .def_readwrite("gear", &Drive::gear)
      .def_readwrite("viscous", &Drive::viscous, "[N m s/rad], >= 0, on the rotor's side.")
      .def_property("friction", function(&Drive::friction), set_function(&Drive::friction),
                    "Of the gear at its output, force by rate; None: none.")
      .def_readwrite("torque_limit", &Drive::torque_limit,
                     "L [N m] at the output: L tanh(wish / L).")
      .def_readwrite("rate_limit", &Drive::rate_limit, "[rad/s] at the output.")
      .def_property(
          "command", function(&Drive::command), set_function(&Drive::command),
          "Torque [N m], rate [rad/s] or position [rad] at time t; None: 0, or an open port.")
      .def_readwrite("kp", &Drive::kp, "Of position [N m/rad].")
      .def_readwrite("kd", &Drive::kd, "Of position [N m s/rad].")
      .def_readwrite("p", &Drive::p, "Of servo [1/s^3, 1/s^2, 1/s], stable: p1 < p2 p3.");
  py::class_<Actuator>(m, "Actuator",
                       "An elastic energy and what drives it. Rotors turn about the joint's axis "
                       "only in what concerns their energy (Spong 1987).")
      .def(from_keywords<Actuator>())
      .def_property(
          "elastic", [](const Actuator& a) { return std::const_pointer_cast<Elastic>(a.elastic); },
          [](Actuator& a, ElasticHandle e) { a.elastic = std::move(e); })
      .def_readwrite("theta", &Actuator::theta)
      .def_readwrite("sigma", &Actuator::sigma, "Only where the energy depends on it.")
      .def_readwrite("damping", &Actuator::damping,
                     "Beside the spring, between link and rotor [N m s/rad], >= 0.");
  m.def(
      "actuator_model",
      [](const Actuator& a) { return std::const_pointer_cast<phs::Model>(actuator_model(a)); },
      arg("actuator"),
      R"(The system of an actuator, without its commands, frictions and limits, which act at its ports.

x = (link, theta, sigma, momentum of theta, momentum of sigma, servos' rates and accelerations), as far as there are such.
Ports: 'link' (flow in: joint rate -> dE/dq), 'theta' and 'sigma' by their drives.)");
  m.def(
      "actuator_start",
      [](const std::string& who, const Actuator& a, double link, double theta, double sigma) {
        return as_array(actuator_start(who, a, link, theta, sigma));
      },
      arg("who"), arg("actuator"), arg("link"), arg("theta"), arg("sigma") = 0.0,
      "The start of that state, at rest. link: the joint's own angle at the start [rad]; "
      "simulate() refuses another. `who` begins the sentences of what is refused.");
  m.def(
      "attach",
      [](phs::Network& n, const std::string& name, const std::string& port, const Actuator& a) {
        attach(n, name, port, a);
      },
      arg("network"), arg("name"), arg("joint_port"), arg("actuator"),
      R"(Adds an actuator `name` to a network and joins it to a joint's port ('<member>.<joint>.torque'), with its commands,
frictions and limits. Ledger: storages '<name>.spring', '<name>.rotor' of theta, '<name>.sigma_rotor'; works by drive
'<name>.theta.torque', '.controller', '.rate' or '.servo'; losses '<name>.theta.viscous', '.friction', '.brake'; the same of
'<name>.sigma'; a loss '<name>.damping' beside the spring. A drive by torque or rate without a command has no work and
leaves its port '<name>.theta' open. The 'damper' of scenes is commanded: '<name>.damper' is a work, of 0 or less.)");
}

}  // namespace

void bind_vsa(py::module_& core) {
  py::module_ m = core.def_submodule("vsa", "Variable-stiffness actuators.");
  bind_elastic(m);
  bind_families(m);
  bind_catalogue(m);
  bind_actuator(m);
}

}  // namespace porthos::python
