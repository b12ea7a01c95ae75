// Redundant arms, floating bases with wheels, moving targets, and tools for choosing gains.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "energy_shaping/certify/sweep.h"
#include "energy_shaping/laws/null_space.h"
#include "energy_shaping/laws/tracking.h"
#include "energy_shaping/laws/wheel_base.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

namespace es = energy_shaping;
using py::arg;
using Numbers = std::vector<double>;

size_t nx(const phs::Model& m) { return size_t(m.description().nx); }
const Numbers& state_of(const phs::Model& m, const Numbers& x) {
  require_size("x", x.size(), nx(m));
  return x;
}

/// The method control() of classes that have port_laws().
template <class C>
void bind_control(py::class_<C, std::shared_ptr<C>>& c) {
  c.def(
      "control",
      [](const C& law, phs::Network& n, const std::string& name, const std::string& member,
         double period) -> phs::Network& {
        return es::control(n, name, member, law.port_laws(), {period, {}, {}});
      },
      py::return_value_policy::reference, arg("network"), arg("name"), arg("member"), py::kw_only(),
      arg("period") = 0.0, "Puts the law on the ports of a network's member.");
}

void bind_null_space(py::module_& m) {
  py::class_<es::NullSpacePosture>(
      m, "NullSpacePosture",
      "A posture for the degrees of freedom that a task leaves, and the tank "
      "that pays for keeping it out of the task.")
      .def(from_keywords<es::NullSpacePosture>())
      .def_readwrite("stiffness", &es::NullSpacePosture::stiffness,
                     "K_n of each joint [N m/rad | N/m]; one number: all.")
      .def_readwrite("rest", &es::NullSpacePosture::rest, "q_n; need not agree with the task.")
      .def_readwrite("level", &es::NullSpacePosture::level, "Energy in the tank at the start [J].")
      .def_readwrite("least", &es::NullSpacePosture::least)
      .def_readwrite("most", &es::NullSpacePosture::most, "Bounds it keeps [J].")
      .def_readwrite("fill", &es::NullSpacePosture::fill,
                     "Share of the injected damping's power that goes into the tank, in [0, 1].");
  py::class_<es::NullSpaceLoop, es::ClosedLoop, std::shared_ptr<es::NullSpaceLoop>>(
      m, "NullSpaceLoop",
      R"(A redundant arm that holds its hand at a place by a spring and its posture by another that the hand does not feel:

    tau = -dU_x - Kd q' - (1 - alpha J^T Jbar^T) K_n (q - q_n),   Jbar = M^-1 J^T (J M^-1 J^T)^-1

Energy that the projected posture makes comes from a tank, whose energy E is a state: (q, p, E). H_d never rises.
task: a PotentialShaping with one pose, damping, and a rest near which to look. Raises InvalidArgument for a task that leaves
no degree of freedom. Source: Khatib 1987; Dietrich, Ott, Stramigioli 2016.)")
      .def(py::init<std::shared_ptr<const mechanics::MechanicalModel>, es::PotentialShaping,
                    es::NullSpacePosture>(),
           arg("plant"), arg("task"), arg("posture"))
      .def_property_readonly("task_size", &es::NullSpaceLoop::task_size)
      .def(
          "projected",
          [](const es::NullSpaceLoop& l, py::object q, py::object tau) {
            const size_t n = l.posture().rest.size();
            return as_array(l.projected(numbers("q", q, n), numbers("tau", tau, n)));
          },
          arg("q"), arg("tau"), "(1 - J^T Jbar^T) tau at q: what the task does not feel.")
      .def(
          "task_acceleration",
          [](const es::NullSpaceLoop& l, py::object q, py::object tau) {
            const size_t n = l.posture().rest.size();
            return as_array(l.task_acceleration(numbers("q", q, n), numbers("tau", tau, n)));
          },
          arg("q"), arg("tau"), "J M^-1 tau.");
}

void bind_wheels(py::module_& m) {
  py::class_<es::WheelBase, std::shared_ptr<es::WheelBase>> wheel_base(
      m, "WheelBase",
      R"(Pose of a floating base by thrusters and reaction wheels: a shaping that asks for a wrench at the base, its force made by
the thrusters and its moment by the wheels, least |tau|. Whatever spin the wheels have, H_d falls. Not a ClosedLoop: the wheels
turn on at rest.)");
  wheel_base
      .def(py::init([](std::shared_ptr<es::PotentialLoop> shaped, std::vector<std::string> wheels,
                       const std::string& base_port, Numbers limits, Numbers capacities,
                       double period, int samples, double tolerance) {
             return std::make_shared<es::WheelBase>(
                 std::move(shaped),
                 es::WheelBaseOptions{base_port, std::move(wheels), std::move(limits),
                                      std::move(capacities), period, samples, tolerance});
           }),
           arg("shaped"), arg("wheels"), py::kw_only(), arg("base_port") = "base.wrench",
           arg("limits") = Numbers{}, arg("capacities") = Numbers{}, arg("period") = 0.0,
           arg("samples") = 500, arg("tolerance") = 1e-10,
           "wheels: their ports, 'wheel_x.torque', of axisymmetric wheels on the base, three axes "
           "or more. limits: largest |torque| of each [N m]; none: without. "
           "capacities: largest momentum of each [N m s], of torques held for `period` [s].")
      .def_property_readonly("certificate", &es::WheelBase::certificate,
                             py::return_value_policy::copy)
      .def(
          "law",
          [](const es::WheelBase& w, py::object x) {
            const auto& plant = w.shaped().plant();
            Numbers u(size_t(plant.description().nu));
            w.law(numbers("x", x, nx(plant)), u);
            return as_array(std::move(u));
          },
          arg("x"), "u of the plant: force, no moment, wheels, joints.")
      .def(
          "hamiltonian",
          [](const es::WheelBase& w, py::object x) {
            return w.hamiltonian(numbers("x", x, nx(w.shaped().plant())));
          },
          arg("x"), "H_d [J].")
      .def(
          "dissipation",
          [](const es::WheelBase& w, py::object x) {
            return w.dissipation(numbers("x", x, nx(w.shaped().plant())));
          },
          arg("x"), "The power H_d falls by [W].");
  bind_control(wheel_base);
}

void bind_tracking(py::module_& m) {
  py::class_<es::Trajectory, std::shared_ptr<es::Trajectory>>(
      m, "Trajectory", "Where the joints are to be: q_d(t) with two derivatives.")
      .def(
          "at",
          [](const es::Trajectory& trajectory, double t) {
            Numbers q(trajectory.size()), v(q), a(q);
            trajectory.at(t, std::span<double>(q), std::span<double>(v), std::span<double>(a));
            return py::make_tuple(as_array(std::move(q)), as_array(std::move(v)),
                                  as_array(std::move(a)));
          },
          arg("t"), "(q_d, q_d', q_d'') at time t.");
  const auto made = [](const std::shared_ptr<const es::Trajectory>& t) {
    return std::const_pointer_cast<es::Trajectory>(t);
  };
  m.def(
      "rest_to_rest",
      [made](Numbers from, Numbers to, double duration) {
        return made(es::rest_to_rest(std::move(from), std::move(to), duration));
      },
      arg("start"), arg("end"), arg("duration"),
      "From one set of coordinates to another: a polynomial of degree 7 with zero rates, "
      "accelerations and jerks at both ends.");
  m.def(
      "sines",
      [made](Numbers centre, Numbers amplitude, Numbers frequency) {
        return made(es::sines(std::move(centre), std::move(amplitude), std::move(frequency)));
      },
      arg("centre"), arg("amplitude"), arg("frequency"),
      "q_i = centre_i + amplitude_i sin(2 pi frequency_i t), frequencies in Hz.");
  py::class_<es::PdPlus, std::shared_ptr<es::PdPlus>> tracking(m, "PdPlus",
                                                               R"(Tracking of a fully actuated arm:

    tau = M(q) q_d'' + C(q, q') q_d' + D q' + dV - Kp e - Kd e',   e = q - q_d

The error energy H_e = e'^T M e' / 2 + e^T Kp e / 2 falls exactly by e'^T Kd e'. Source: Paden, Panja 1988.)");
  tracking
      .def(py::init([](std::shared_ptr<const mechanics::MechanicalModel> plant,
                       std::shared_ptr<es::Trajectory> trajectory, Numbers kp, Numbers kd) {
             return std::make_shared<es::PdPlus>(std::move(plant), std::move(trajectory),
                                                 std::move(kp), std::move(kd));
           }),
           arg("plant"), arg("trajectory"), arg("kp"), arg("kd"))
      .def(
          "error",
          [](es::PdPlus& p, double t, const Numbers& x) {
            return p.error(t, state_of(p.plant(), x));
          },
          arg("t"), arg("x"), "The largest |e_i| [rad | m] at the plant's state x = (q, p).")
      .def(
          "error_energy",
          [](es::PdPlus& p, double t, const Numbers& x) {
            return p.error_energy(t, state_of(p.plant(), x));
          },
          arg("t"), arg("x"), "H_e [J].")
      .def(
          "error_power",
          [](es::PdPlus& p, double t, const Numbers& x) {
            return p.error_power(t, state_of(p.plant(), x));
          },
          arg("t"), arg("x"), "e'^T Kd e' [W], the rate H_e falls at.");
  bind_control(tracking);
}

/// A number of a sweep's result under the name it had until version 0.2.
auto renamed(const char* old, const char* now, double es::SweepResult::*number) {
  return [=](const es::SweepResult& r) {
    const std::string text = fmt::format("SweepResult.{} is now {}", old, now);
    if (PyErr_WarnEx(PyExc_DeprecationWarning, text.c_str(), 1) != 0) throw py::error_already_set();
    return r.*number;
  };
}

void bind_sweep(py::module_& m) {
  py::class_<es::SweepResult>(m, "SweepResult", "One run of a sweep.")
      .def_readonly("gains", &es::SweepResult::gains)
      .def_readonly(
          "settling", &es::SweepResult::settling,
          "Time after which H_d stays below `settled` of its start [s]; inf: never, or not "
          "`defined`.")
      .def_readonly("peak", &es::SweepResult::peak, "Largest |u| [N m | N].")
      .def_readonly("residual", &es::SweepResult::residual, "Share of H_d that is left at the end.")
      .def_readonly("max_excursion", &es::SweepResult::max_excursion, "Largest |q_i - q_i*|.")
      .def_property_readonly("left", renamed("left", "residual", &es::SweepResult::residual),
                             "Deprecated: residual.")
      .def_property_readonly("travel",
                             renamed("travel", "max_excursion", &es::SweepResult::max_excursion),
                             "Deprecated: max_excursion.")
      .def_readonly("finite", &es::SweepResult::finite)
      .def_readonly("defined", &es::SweepResult::defined,
                    "False: the run left where the law is meant (half_width of "
                    "numerical_matching).")
      .def_readonly("elsewhere", &es::SweepResult::elsewhere,
                    "True: H_d came down at another minimum, as a full turn away.");
  m.def(
      "sweep",
      [](const es::ClosedLoop& loop, const std::vector<Numbers>& gains, Numbers start,
         double duration, double step, double settled, int threads, Numbers limits) {
        const py::gil_scoped_release released;
        return es::sweep(loop, gains,
                         {std::move(start), duration, step, settled, threads, std::move(limits)});
      },
      arg("loop"), arg("gains"), py::kw_only(), arg("start"), arg("duration") = 20.0,
      arg("step") = 0.01, arg("settled") = 1e-2, arg("threads") = 0, arg("limits") = Numbers(),
      "Closed-loop runs with other gains, one row each in the order of gain_names, eight in SIMD "
      "lanes at a time. Results in the order of `gains`, the same for any number of threads (0: "
      "as many as the machine has). limits: largest |u| of each actuated input in the runs.");
  m.def("grid", &es::grid_of, arg("values"),
        "All combinations of the values of each gain, the last one fastest.");
  m.def("logarithmic", &es::logarithmic, arg("low"), arg("high"), arg("count"),
        "Values from low to high, even in their logarithms.");
  m.def(
      "fastest",
      [](const std::vector<es::SweepResult>& results, double limit) {
        const int best = es::fastest(results, limit);
        return best < 0 ? std::nullopt : std::optional(best);
      },
      arg("results"), arg("limit"),
      "Index of the run that settles first among those with peak <= limit; None if none does.");
}

}  // namespace

void bind_regulation(py::module_& core) {
  py::module_ m = core.attr("energy_shaping");
  bind_null_space(m);
  bind_wheels(m);
  bind_tracking(m);
  bind_sweep(m);
}

}  // namespace porthos::python
