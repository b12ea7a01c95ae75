// Laws designed for a mechanism of the user's own: matching by quadratures, swing-up, balancing.
#include <pybind11/stl.h>

#include "energy_shaping/laws/handover.h"
#include "energy_shaping/laws/joint_swing_up.h"
#include "energy_shaping/laws/lqr.h"
#include "energy_shaping/loop/held_loop.h"
#include "energy_shaping/matching/numerical_matching.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {
namespace {

namespace es = energy_shaping;
using py::arg;
using Numbers = std::vector<double>;
using MechanicalPtr = std::shared_ptr<const mechanics::MechanicalModel>;

void bind_numerical_matching(py::module_& m) {
  m.def(
      "numerical_matching",
      [](std::shared_ptr<const phs::Model> plant, const std::string& actuator, double ratio,
         int unactuated, double half_width, double scale, double determinant, double ku, double kv,
         double other, double rate, int degree, double matching, const std::string& name,
         const Numbers& rest) {
        require_size("rest", rest.size(), 2);
        const py::gil_scoped_release released;
        return std::const_pointer_cast<es::MatchedLoop>(
            es::numerical_matching(std::move(plant), {name,
                                                      actuator,
                                                      unactuated,
                                                      ratio,
                                                      half_width,
                                                      scale,
                                                      determinant,
                                                      ku,
                                                      kv,
                                                      other,
                                                      rate,
                                                      degree,
                                                      matching,
                                                      {rest[0], rest[1]}}));
      },
      arg("plant"), py::kw_only(), arg("actuator"), arg("ratio"), arg("unactuated") = 1,
      arg("half_width") = 1.0, arg("scale") = 1.0, arg("determinant") = 1.0, arg("ku") = 100.0,
      arg("kv") = 1.0, arg("other") = 3.0, arg("rate") = 2.0, arg("degree") = 60,
      arg("matching") = 1e-6, arg("name") = "numerical matching", arg("rest") = Numbers{0, 0},
      R"(Matching (IDA-PBC) of two coordinates with one actuator without a closed form: a MatchedLoop that rests at q = rest.

plant: two coordinates, an equilibrium at q = rest, from which r and s count: state the upright if the model hangs at 0 (the
certificate has a line "rest without the law" where the design is for a hanging position). Its masses depend on the coordinate
r without actuator alone (a pendubot, a cart and pole). actuator: port of the other one, s. ratio: rho = lambda_s/lambda_r of
lambda = M^-1 M_d e_r. unactuated: r, 0 or 1; it is looked at within +-half_width [rad | m] of rest, beyond which
the law is not defined (nan, or any number) and certify() refuses boxes and starts; |s| up to `other`, |q'_i| up to `rate`. scale: |lambda_r| at rest;
determinant: det M_d over its (r, r) number. ku, kv: gains of s - rho r and of damping. degree of the Chebyshev polynomials;
matching: bound of the relative residuals. Raises InvalidArgument for an actuator of r, a rest at which r is not in equilibrium or near which nothing pulls it, where rho M_rs + M_rr vanishes in the interval, with the place,
where the polynomials do not resolve the functions, and for residuals above the bound. Cost: some ms to some 100 ms.
Source: after Auckly, Kapitanski, White 2000.)");
}

void bind_numerical_gains(py::module_& m) {
  m.def(
      "numerical_matching_gains",
      [](const std::shared_ptr<const phs::Model>& plant, double bandwidth, double damping_ratio,
         double ratio, int unactuated, double scale, const Numbers& rest) {
        require_size("rest", rest.size(), 2);
        es::NumericalMatching o;
        o.unactuated = unactuated;
        o.ratio = ratio;
        o.scale = scale;
        o.rest = {rest[0], rest[1]};
        {
          const py::gil_scoped_release released;
          o = es::numerical_matching_gains(*plant, o, bandwidth, damping_ratio);
        }
        py::dict gains;
        gains["ratio"] = o.ratio;
        gains["ku"] = o.ku;
        gains["kv"] = o.kv;
        gains["determinant"] = o.determinant;
        return gains;
      },
      arg("plant"), py::kw_only(), arg("bandwidth"), arg("damping_ratio") = 0.7, arg("ratio") = 0.0,
      arg("unactuated") = 1, arg("scale") = 1.0, arg("rest") = Numbers{0, 0},
      R"(ratio, ku, kv and determinant of numerical_matching() by a bandwidth [rad/s] and a damping ratio: a dict, as in
numerical_matching(plant, actuator=..., **numerical_matching_gains(plant, bandwidth=7)).

The loop linearised at the rest point has both twice. The ratio alone decides on the bandwidth: of one that is given (not 0) the
nearest are found. The other arguments are those of numerical_matching. Raises InvalidArgument for numbers that are not above 0, a
rest that is no equilibrium, and where no gains make the rest point attract. Cost: some 100 ms.)");
}

void bind_swing_up(py::module_& m) {
  using Swing = es::JointSwingUp;
  py::class_<Swing, std::shared_ptr<Swing>>(
      m, "JointSwingUp",
      "The law of swing_up(): a mechanism swings up by the energy of one driven joint.")
      .def_property_readonly("certificate", &Swing::certificate, py::return_value_policy::copy)
      .def_property_readonly("wanted_energy", &Swing::wanted_energy,
                             "H at rest in the upright and the margin [J].")
      .def("check_start", &Swing::check_start, arg("x"),
           "Raises InvalidArgument for a start (q, p), (2 nq,), that plant and law never leave.")
      .def(
          "control",
          [](const Swing& s, phs::Network& n, const std::string& name, const std::string& member,
             double period) -> phs::Network& {
            return es::control(n, name, member, {s.port_law()}, {.period = period});
          },
          py::return_value_policy::reference, arg("network"), arg("name"), arg("member"),
          py::kw_only(), arg("period") = 0.0,
          "Puts the law on its port of a network's member. period [s]; 0: continuous.");
  m.def(
      "swing_up",
      [](MechanicalPtr plant, const std::string& actuator, Numbers upright,
         std::optional<double> bandwidth, double damping_ratio, double pump, double energy,
         double inertia, double stiffness, double damping, double limit,
         std::optional<double> margin) {
        es::SwingUpGains g{energy, inertia, stiffness, damping, limit, pump, margin};
        if (bandwidth) {
          if (energy != 0 || inertia != 0 || stiffness != 0 || damping != 0)
            throw InvalidArgument(
                "swing_up: energy, inertia, stiffness or damping is given besides bandwidth, "
                "expected one of both");
          g = es::SwingUpGains::of_bandwidth(*bandwidth, damping_ratio);
          g.limit = limit;
          g.pump = pump;
          g.margin = margin;
        } else if (energy == 0 || pump != 0) {
          throw InvalidArgument(
              pump != 0 ? "swing_up: pump is given without bandwidth, expected both"
                        : "swing_up: neither bandwidth nor energy is given, expected one of both");
        }
        const py::gil_scoped_release released;
        return std::make_shared<Swing>(std::move(plant), actuator, std::move(upright), g);
      },
      arg("plant"), arg("actuator"), arg("upright"), py::kw_only(), arg("bandwidth") = py::none(),
      arg("damping_ratio") = 0.3, arg("pump") = 0.0, arg("energy") = 0.0, arg("inertia") = 0.0,
      arg("stiffness") = 0.0, arg("damping") = 0.0, arg("limit") = HUGE_VAL,
      arg("margin") = py::none(),
      R"(Swings a mechanism up by the energy that one driven joint supplies: a JointSwingUp with its certificate.

actuator: port of the driven joint, 'shoulder.torque'. upright: q*, (nq,) [rad | m]. Gains by the bandwidth [rad/s] and damping
ratio of the driven joint, with a pump [rad/s^2 | m/s^2] against friction of the other joints; or the four numbers energy,
inertia, stiffness, damping (docs/controllers.md). limit: of |u| [N m | N]. margin: energy aimed at above that of the upright
[J]. It does not balance: hand_over() lets an Lqr take over. Raises InvalidArgument for joints of several degrees of freedom, closed loops,
and gains for which the law is not defined everywhere. Source: Astrom, Furuta 2000; Fantoni, Lozano 2002.)");
}

void bind_lqr(py::module_& m) {
  py::class_<es::Lqr, std::shared_ptr<es::Lqr>>(
      m, "Lqr",
      R"(The linear-quadratic regulator of a mechanism about an equilibrium: u = u* - K (x - x*), x = (q, p). Local: the
certificate has the poles of the linearised loop. Source: Kalman 1960.)")
      .def(py::init([](MechanicalPtr plant, std::vector<std::string> actuators, Numbers rest,
                       Numbers position, Numbers rate, Numbers effort, std::vector<bool> periodic) {
             return std::make_shared<es::Lqr>(
                 std::move(plant), std::move(actuators), std::move(rest),
                 es::LqrWeights{std::move(position), std::move(rate), std::move(effort)},
                 std::move(periodic));
           }),
           arg("plant"), arg("actuators"), arg("rest"), py::kw_only(), arg("position"), arg("rate"),
           arg("effort"), arg("periodic") = std::vector<bool>{},
           "actuators: ports of one number each. rest: q*, (nq,). Weights: position and rate of "
           "each coordinate, (nq,), effort of each actuator. periodic: which angles count modulo "
           "full turns, (nq,). Raises InvalidArgument for weights of the wrong number or sign, "
           "and a rest that is no equilibrium or that the actuators cannot stabilise.")
      .def_property_readonly("certificate", &es::Lqr::certificate, py::return_value_policy::copy)
      .def("certify_sampled", &es::Lqr::certify_sampled, arg("period"), arg("delay") = 0,
           "Adds the condition 'sampled': the held linear loop is stable. period [s]. Of several "
           "periods the worst stays, its text tells the rate. Raises InvalidArgument with a rate "
           "that would do.")
      .def_property_readonly(
          "gains", [](const es::Lqr& l) { return array_of(l.gains()); },
          "K, (actuators, 2 nq), on (q - q*, p).")
      .def_property_readonly("effort", &es::Lqr::effort, "u* of each actuator.")
      .def(
          "cost_to_go",
          [](const es::Lqr& l, py::object x) { return l.cost_to_go(numbers("x", x, l.size())); },
          arg("x"), "(x - x*)^T P (x - x*) at (q, p), (2 nq,).")
      .def("falling_level", &es::Lqr::falling_level, arg("limits") = Numbers{},
           "Up to which cost_to_go() falls along the plant under the law: 400 directions and the "
           "worst near them; 0: none. Some ms.")
      .def(
          "control",
          [](const es::Lqr& l, phs::Network& n, const std::string& name, const std::string& member,
             const Numbers& limits, double period) -> phs::Network& {
            return es::control(n, name, member, l.port_laws(limits), {.period = period});
          },
          py::return_value_policy::reference, arg("network"), arg("name"), arg("member"),
          py::kw_only(), arg("limits") = Numbers{}, arg("period") = 0.0,
          "Puts the law on the ports of a network's member. limits: largest |u| of each; none: "
          "without. period [s]; 0: continuous.");
}

phs::Network& hand_over(phs::Network& n, const std::string& member, const es::JointSwingUp& swing,
                        std::shared_ptr<es::Lqr> balance, double period, const Numbers& limits,
                        std::optional<double> level, double leave,
                        const std::pair<std::string, std::string>& names) {
  if (!(period > 0))
    throw InvalidArgument("hand_over: period is not above 0 s, expected sampled laws");
  const double falling = balance->falling_level(limits);
  if (!(level.value_or(falling) > 0))
    throw InvalidArgument(
        "hand_over: the cost-to-go of the law that takes over falls nowhere, expected weights of "
        "every joint, larger limits, or a level");
  const es::LevelSet basin{[balance](std::span<const double> x) {
                             return balance->cost_to_go(x.first(balance->size()));
                           },
                           level.value_or(falling),
                           [balance, falling, limits, period](double higher) {
                             return balance->lost(higher, falling, limits, period);
                           }};
  const es::Handover gates(names.first, names.second, basin, leave, swing.progress());
  es::control(n, names.first, member, {swing.port_law()}, {.period = period, .gate = gates.from()});
  return es::control(n, names.second, member, balance->port_laws(limits),
                     {.period = period, .gate = gates.to()});
}

}  // namespace

void bind_mechanism_laws(py::module_& core) {
  core.def(
      "linearise",
      [](const std::shared_ptr<const phs::Model>& model, const py::object& x, const py::object& u,
         bool rates) {
        const auto& d = model->description();
        const auto at = numbers("x", x, size_t(d.nx));
        const auto in = u.is_none() ? Numbers{} : numbers("u", u, size_t(d.nu));
        const auto mechanism = std::dynamic_pointer_cast<const mechanics::MechanicalModel>(model);
        const size_t n = at.size() / 2;
        if (rates && (!mechanism ||
                      std::any_of(at.begin() + long(n), at.end(), [](double p) { return p != 0; })))
          throw InvalidArgument(
              "linearise: rates=True is given for a network or a motion, expected a "
              "MechanicalModel at rest");
        const es::LinearPlant of =
            rates ? es::linear_plant_in_rates(*mechanism, std::span(at).first(n), in)
                  : es::linear_plant(*model, at, in);
        const std::string odd = rates ? es::unbalanced(*mechanism, std::span(at).first(n), in) : "";
        if (!odd.empty() && PyErr_WarnEx(PyExc_UserWarning, ("linearise: " + odd).c_str(), 1) != 0)
          throw py::error_already_set();
        const auto array = [](const phs::Matrix& M) {
          return as_array(M.a, Shape{py::ssize_t(M.rows), py::ssize_t(M.cols)});
        };
        return py::make_tuple(array(of.A), array(of.B));
      },
      arg("model"), arg("x"), arg("u") = py::none(), py::kw_only(), arg("rates") = false,
      R"(A and B of dx' = A dx + B du about a state, exact to rounding: a tuple of arrays (nx, nx) and (nx, nu).

model: any without closed loops, a mechanism or a network; springs and dampers of joints and elements are part of it. x: the
state, (nx,), of a mechanism (q, p), as model.state(q, v) makes it; u: the inputs there, (nu,), None: 0. rates: of a
MechanicalModel at rest, in (q, q') in place of (q, p); a warning tells where it is no equilibrium. Raises InvalidArgument for other
numbers, for closed loops and sampled laws, and with rates for a state that moves, joints of several degrees of freedom, and other models.)");
  py::module_ m = core.attr("energy_shaping");
  bind_numerical_matching(m);
  bind_numerical_gains(m);
  bind_swing_up(m);
  bind_lqr(m);
  m.def(
      "hand_over", &hand_over, py::return_value_policy::reference, arg("network"), arg("member"),
      arg("swing_up"), arg("balance"), py::kw_only(), arg("period"), arg("limits") = Numbers{},
      arg("level") = py::none(), arg("leave") = 4.0,
      arg("names") = std::pair<std::string, std::string>("swing_up", "balance"),
      R"(Puts a JointSwingUp and an Lqr on the ports of a network's member, both sampled every `period` [s]: the Lqr acts
once its cost_to_go() is below `level` (None: falling_level()), the swing-up again where it is above leave * level. limits: of the
Lqr. names: their rows in the ledger. Raises InvalidArgument where the cost-to-go falls nowhere, or leave is 1 or less.)");
}

}  // namespace porthos::python
