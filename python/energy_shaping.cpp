// Controllers as closed loops, their certificates, and their laws on the ports of a network.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include <variant>

#include "energy_shaping/certify/certify.h"
#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/port_law.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

namespace es = energy_shaping;
using py::arg;

void bind_certificate(py::module_& m) {
  py::enum_<es::Finding>(m, "Finding")
      .value("holds", es::Finding::holds)
      .value("fails", es::Finding::fails)
      .value("reported", es::Finding::reported)
      .value("not_judged", es::Finding::not_judged);
  py::class_<es::CertificateItem>(m, "CertificateItem",
                                  "One line of a certificate: a condition with its number and "
                                  "bound, or a figure without a bound.")
      .def_readonly("name", &es::CertificateItem::name)
      .def_readonly("finding", &es::CertificateItem::finding)
      .def_readonly("value", &es::CertificateItem::value)
      .def_readonly("bound", &es::CertificateItem::bound, "NaN: none.")
      .def_readonly("text", &es::CertificateItem::text, "What was looked at, in a few words.")
      .def_readonly("numbers", &es::CertificateItem::numbers)
      .def_readonly("at", &es::CertificateItem::at,
                    "The state or coordinates where the worst was found; may be empty.");
  py::class_<es::Certificate>(m, "Certificate", "What was verified of a closed loop, and how.")
      .def_property_readonly("title", &es::Certificate::title)
      .def_property_readonly("items", [](const es::Certificate& c) { return c.items(); })
      .def("item", &es::Certificate::item, arg("name"))
      .def_property_readonly("holds", &es::Certificate::holds,
                             "No item fails, and none is not judged.")
      .def("text", &es::Certificate::text, "A table for people.")
      .def("json", &es::Certificate::json, "The same for programs.")
      .def("html", &es::Certificate::html, "The table for pages.")
      .def("_repr_html_", &es::Certificate::html)
      .def("__str__", &es::Certificate::text)
      .def("__bool__", &es::Certificate::holds);
}

/// The results of a run of a loop, as arrays.
py::dict run_of(const es::Run& r) {
  const auto table = [](const std::vector<std::vector<double>>& rows) {
    std::vector<double> a;
    for (const auto& row : rows) a.insert(a.end(), row.begin(), row.end());
    const auto n = py::ssize_t(rows.size());
    return as_array(std::move(a), {n, n ? py::ssize_t(rows[0].size()) : 0});
  };
  py::dict d;
  d["t"] = as_array(r.t);
  d["H"] = as_array(r.H);
  d["x"] = table(r.x);
  d["u"] = table(r.u);
  d["peak"] = r.peak;
  d["rise"] = r.rise;
  d["dissipated"] = r.dissipated;
  d["injected"] = r.injected;
  d["finished"] = r.finished;
  d["outcome"] = r.outcome;
  return d;
}

es::Region region_of(const std::vector<double>& lower, const std::vector<double>& upper,
                     double rate, int samples) {
  es::Region r;
  r.lower = lower;
  r.upper = upper;
  r.rate = rate;
  r.samples = samples;
  return r;
}

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_loops(py::module_& m) {
  py::class_<es::ClosedLoop, phs::Model, std::shared_ptr<es::ClosedLoop>>(
      m, "ClosedLoop",
      R"(A closed loop as a port-Hamiltonian system with the energy H_d it was shaped to have, and a certificate. State: that of
the plant. The field of this model is the target dynamics; that the plant under the law moves so is what was verified.)")
      .def_property_readonly("plant",
                             [](const es::ClosedLoop& l) {
                               return std::const_pointer_cast<phs::Model>(l.shared_plant());
                             })
      .def_property_readonly("rest", &es::ClosedLoop::rest, "x*: where the loop is to rest.")
      .def_property_readonly("certificate", &es::ClosedLoop::certificate,
                             py::return_value_policy::copy)
      .def_property_readonly("actuated", &es::ClosedLoop::actuated,
                             "Offsets in the plant's u that the law writes.")
      .def_property_readonly("gain_names", &es::ClosedLoop::gain_names)
      .def(
          "law",
          [](const es::ClosedLoop& l, double t, py::object x) {
            Rows r;
            const Source at = r.in("x", x, size_t(l.description().nx));
            if (r.batched()) throw InvalidArgument("x has several states, expected one");
            std::vector<double> u(size_t(l.plant().description().nu));
            {
              const py::gil_scoped_release released;
              l.loop<double>()->law(t, {at.data, at.n}, u);
            }
            return as_array(std::move(u));
          },
          arg("t"), arg("x"),
          "u, as many numbers as the plant has inputs, 0 where there is no actuator.");

  py::class_<es::JointSpring>(m, "JointSpring",
                              "A spring at a joint of one degree of freedom: U = k (q - rest)^2 / "
                              "2, or k (1 - cos(q - rest)).")
      .def(from_keywords<es::JointSpring>())
      .def_readwrite("port", &es::JointSpring::port, "'shoulder.torque'")
      .def_readwrite("stiffness", &es::JointSpring::stiffness)
      .def_readwrite("rest", &es::JointSpring::rest)
      .def_readwrite("periodic", &es::JointSpring::periodic);
  py::class_<es::PoseSpring>(
      m, "PoseSpring",
      R"(A spring between a body and a place in the world, of a link's point and of its attitude:
U = k |r - position|^2 / 2 + tr(A (1 - R_d^T R)), A = diag(attitude_stiffness).)")
      .def(from_keywords<es::PoseSpring>())
      .def_readwrite("link", &es::PoseSpring::link)
      .def_property(
          "point", [](const es::PoseSpring& s) { return tuple_of(s.point); },
          [](es::PoseSpring& s, py::object v) { s.point = vector3("point", v); },
          "In the link's frame [m].")
      .def_readwrite("stiffness", &es::PoseSpring::stiffness, "k [N/m]")
      .def_property(
          "position", [](const es::PoseSpring& s) { return tuple_of(s.position); },
          [](es::PoseSpring& s, py::object v) { s.position = vector3("position", v); },
          "In the world [m].")
      .def_property(
          "attitude_stiffness",
          [](const es::PoseSpring& s) { return tuple_of(s.attitude_stiffness); },
          [](es::PoseSpring& s, py::object v) {
            s.attitude_stiffness = vector3("attitude_stiffness", v);
          },
          "[N m]")
      .def_property(
          "attitude", [](const es::PoseSpring& s) { return array_of(s.attitude); },
          [](es::PoseSpring& s, py::object v) { s.attitude = matrix3("attitude", v); },
          "R_d, (3, 3).");
  py::class_<es::PortDamping>(m, "PortDamping", "Damping -d y at a port, on each of its numbers.")
      .def(from_keywords<es::PortDamping>())
      .def_readwrite("port", &es::PortDamping::port)
      .def_readwrite("damping", &es::PortDamping::damping, "One number for all, or one each.");
  py::class_<es::PotentialShaping>(m, "PotentialShaping", "What a mechanism shall feel.")
      .def(from_keywords<es::PotentialShaping>())
      .def_readwrite("name", &es::PotentialShaping::name)
      .def_readwrite("joints", &es::PotentialShaping::joints)
      .def_readwrite("poses", &es::PotentialShaping::poses)
      .def_readwrite("damping", &es::PotentialShaping::damping)
      .def_readwrite("compensate", &es::PotentialShaping::compensate,
                     "Takes the plant's own potential away, gravity and the springs of joints, so "
                     "that H_d = T + U. Raises where it acts at a joint without actuator.")
      .def_readwrite(
          "constant_compensation", &es::PotentialShaping::constant_compensation,
          "A constant force that balances the plant's potential at the rest point instead.")
      .def_readwrite("actuators", &es::PotentialShaping::actuators,
                     "Ports with an actuator; empty: every joint port.")
      .def_readwrite("zero_momentum", &es::PotentialShaping::zero_momentum,
                     "For a base that floats without actuators: the loop of total momentum zero.")
      .def_readwrite("rest", &es::PotentialShaping::rest, "Rest coordinates, nq numbers.")
      .def_readwrite("tolerance", &es::PotentialShaping::tolerance);
  py::class_<es::PotentialLoop, es::ClosedLoop, std::shared_ptr<es::PotentialLoop>>(
      m, "PotentialLoop",
      R"(A mechanism with potential shaping and damping injection: the plant's own structure with

    H_d = H + U (- V),  R_d = R + G Kd G^T,  u = -dU - Kd y.

Raises InvalidArgument naming the port, link or number at fault, a force no actuator can make, or a rest point that is none.)")
      .def(py::init<std::shared_ptr<const mechanics::MechanicalModel>, es::PotentialShaping>(),
           arg("plant"), arg("shaping"));
  m.def(
      "joint_regulation", &es::joint_regulation, arg("model"), arg("rest"), arg("bandwidth"),
      arg("damping_ratio"), arg("skip") = std::vector<std::string>{},
      R"(Joint springs and dampers of a bandwidth [rad/s] and damping ratio at the rest point: k = M_jj w^2, d = 2 zeta M_jj w,
M_jj the mass the joint feels there while the others stand still. A PotentialShaping. skip: joints without an actuator, which get
neither: names of ports or of their joints, "elbow.torque" or "elbow"; another name raises InvalidArgument. Where gravity or a
spring, JointSpec(stiffness=), acts at one, it takes two settings: shaping.compensate = False, since nothing can cancel the
force there, and in rest the angle at which that joint hangs, where the force is 0 with the others at their rest; another is
refused as no rest point.)");
  py::class_<es::MatchedLoop, es::ClosedLoop, std::shared_ptr<es::MatchedLoop>>(
      m, "MatchedLoop",
      "A plant under interconnection and damping assignment (IDA-PBC): kinetic and potential "
      "energy shaped, the matching "
      "equations checked over a region.")
      .def(
          "residual",
          [](const es::MatchedLoop& l, py::object x) {
            const auto r = l.residual(numbers("x", x, size_t(l.description().nx)));
            return std::make_pair(r.kinetic, r.potential);
          },
          arg("x"), "Relative residuals of the matching equations, (kinetic, potential).")
      .def(
          "state",
          [](const es::MatchedLoop& l, const std::vector<double>& q, const std::vector<double>& v) {
            return as_array(l.state(q, v));
          },
          arg("q"), arg("v"), "(q, p = M(q) v).");
}

/// One number for each actuated input, or one for all.
using InputLimits = std::variant<double, std::vector<double>>;
std::vector<double> input_limits_of(const es::ClosedLoop& loop, const InputLimits& limits) {
  if (const double* one = std::get_if<double>(&limits))
    return std::vector<double>(loop.actuated().size(), *one);
  return std::get<1>(limits);
}

void bind_runs(py::module_& m) {
  m.def(
      "simulate",
      [](const es::ClosedLoop& loop, const std::vector<double>& x0, double duration, double step,
         const std::string& method, double period, const InputLimits& limits,
         std::shared_ptr<const phs::Model> plant, double record) {
        es::RunOptions o{duration,    step,  method, period, input_limits_of(loop, limits),
                         plant.get(), record};
        es::Run r;
        {
          const py::gil_scoped_release released;
          r = es::simulate(loop, x0, o);
        }
        return run_of(r);
      },
      arg("loop"), arg("x0"), py::kw_only(), arg("duration") = 10.0, arg("step") = 0.01,
      arg("method") = "gauss8", arg("period") = 0.0,
      arg("limits") = InputLimits(std::vector<double>{}), arg("plant") = py::none(),
      arg("record") = 0.0,
      R"(A simulated run of the plant under the law: a dict of arrays t, H (H_d), x, u (actuated inputs), and peak (largest |u|),
rise (largest rise of H_d over a step [J]), dissipated, injected (what sampling, limits and another plant put in [J]),
finished, outcome. period of the controller [s], a multiple of step; 0: continuous. limits: largest |u| of each actuated input
[N m | N], or one number for all; []: without. record: [s] between records.)");
  m.def(
      "certify",
      [](const es::ClosedLoop& loop, const std::vector<double>& lower,
         const std::vector<double>& upper, double rate, int samples,
         std::vector<std::vector<double>> starts, std::vector<double> periods, double duration,
         double step, double settled, const InputLimits& limits) {
        es::CertifyOptions o;
        o.region = region_of(lower, upper, rate, samples);
        o.starts = std::move(starts);
        o.periods = std::move(periods);
        o.settled = settled;
        o.run.duration = duration;
        o.run.step = step;
        o.run.limits = input_limits_of(loop, limits);
        const py::gil_scoped_release released;
        return es::certify(loop, o);
      },
      arg("loop"), py::kw_only(), arg("lower"), arg("upper"), arg("rate") = 1.0,
      arg("samples") = 2000, arg("starts") = std::vector<std::vector<double>>{},
      arg("periods") = std::vector<double>{0.0}, arg("duration") = 10.0, arg("step") = 0.01,
      arg("settled") = 1e-2, arg("limits") = InputLimits(std::vector<double>{}),
      R"(The certificate of the constructor, and: H_d' against the formula, linearised eigenvalues, critical points and basin (up to 3
coordinates), H_d of each start against it, inputs on the basin, runs of the plant as sampled. lower, upper: the box of
coordinates looked at, (nq,); rate: |q'_i| up to this. starts: states (nx,) that the runs start from; periods of the controller
in them [s], multiples of step, 0: continuous. limits: largest |u| of each actuated input [N m | N], or one number for all; []:
without. They act in the runs, and the shares of them that runs and basin take are told.
Raises InvalidArgument for no samples, for periods without starts, for limits and starts that do not fit the loop, and, up to 3 coordinates, for a box
without the rest point inside; for a box and starts beyond the half_width of numerical_matching() too. Cost: seconds.)");
  m.def(
      "control",
      [](phs::Network& n, const std::string& name, const std::string& member,
         std::shared_ptr<es::ClosedLoop> loop, const std::vector<double>& limits,
         double period) -> phs::Network& {
        return es::control(n, name, member,
                           es::port_laws(std::shared_ptr<const es::ClosedLoop>(loop), limits),
                           {period, {}, {}});
      },
      py::return_value_policy::reference, arg("network"), arg("name"), arg("member"), arg("loop"),
      py::kw_only(), arg("limits") = std::vector<double>{}, arg("period") = 0.0,
      R"(Puts the law of a loop on the ports of a member of a network. Ledger: `name`, and `name`.hold of a sampled one; over
several ports `name`.<port>. limits: largest |u| of each actuated input; none: without.)");
}

}  // namespace

void bind_energy_shaping(py::module_& core) {
  py::module_ m = core.def_submodule("energy_shaping",
                                     "Controllers as closed loops with an energy of their own.");
  bind_certificate(m);
  bind_loops(m);
  bind_designs(m);
  bind_runs(m);
}

}  // namespace porthos::python
