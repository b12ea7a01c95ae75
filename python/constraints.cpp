// Closed loops, couplings, rolling bodies and driven joints of mechanisms.
#include <pybind11/stl.h>

#include <tuple>
#include <variant>

#include "mechanics/constraints/projection.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/reactions.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {

namespace {

using namespace mechanics;
using Constraint = std::variant<LoopJoint, Rod, Coupling, Rolling, Driven>;

ConstraintSpec spec_of(const std::vector<Constraint>& list) {
  ConstraintSpec spec;
  for (const Constraint& c : list) {
    if (const auto* loop = std::get_if<LoopJoint>(&c)) spec.loops.push_back(*loop);
    if (const auto* rod = std::get_if<Rod>(&c)) spec.rods.push_back(*rod);
    if (const auto* coupling = std::get_if<Coupling>(&c)) spec.couplings.push_back(*coupling);
    if (const auto* rolling = std::get_if<Rolling>(&c)) spec.rollings.push_back(*rolling);
    if (const auto* driven = std::get_if<Driven>(&c)) spec.driven.push_back(*driven);
  }
  return spec;
}

const ConstraintSet& loops_of(const MechanicalModel& p) {
  if (!p.constraint_set())
    throw InvalidArgument("'" + p.description().name + "' has no constraints");
  return *p.constraint_set();
}

void bind_constraint_specs(py::module_& m) {
  py::class_<LinkFrame>(m, "LinkFrame", "A frame fixed to a link of a mechanism, or to the world.")
      .def(from_keywords<LinkFrame>())
      .def_readwrite("link", &LinkFrame::link, "Any body of the mechanism; empty: the world.")
      .def_property(
          "position", [](const LinkFrame& f) { return tuple_of(f.pose.r); },
          [](LinkFrame& f, py::object v) { f.pose.r = vector3("position", v); },
          "Origin in the link's frame [m].")
      .def_property(
          "axes", [](const LinkFrame& f) { return array_of(f.pose.R); },
          [](LinkFrame& f, py::object v) { f.pose.R = matrix3("axes", v); },
          "Its axes as columns in the link's frame, (3, 3).");
  py::class_<LoopJoint>(
      m, "LoopJoint",
      R"(A joint that closes a loop: frame b moves relative to frame a as the type allows. Types: revolute, continuous,
prismatic, cylindrical, helical (about and along z), spherical, universal (z of a, x of b), planar (in x, y), fixed;
on_plane, on_line, on_curve: only the origin of b is held, on z = 0, on the z axis, on a smooth curve through points.)")
      .def(from_keywords<LoopJoint>())
      .def_readwrite("name", &LoopJoint::name)
      .def_readwrite("type", &LoopJoint::type)
      .def_readwrite("a", &LoopJoint::a)
      .def_readwrite("b", &LoopJoint::b)
      .def_readwrite("pitch", &LoopJoint::pitch, "Of a helical joint [m/rad].")
      .def_readwrite("points", &LoopJoint::points,
                     "Of on_curve: [x, y] in a [m], about equally far apart, >= 2 (closed: 3).")
      .def_readwrite("closed", &LoopJoint::closed,
                     "Of on_curve: whether the last point is joined to the first.");
  py::class_<Rod>(m, "Rod", "A massless rod: the origins of both frames keep their distance.")
      .def(from_keywords<Rod>())
      .def_readwrite("name", &Rod::name)
      .def_readwrite("a", &Rod::a)
      .def_readwrite("b", &Rod::b)
      .def_readwrite("length", &Rod::length, "[m], > 0");
  py::class_<Coupling>(m, "Coupling",
                       "A gear, belt, rack or mimic joint: the sum of factor * coordinate is the "
                       "offset; angles count their turns.")
      .def(from_keywords<Coupling>())
      .def_readwrite("name", &Coupling::name)
      .def_property(
          "factors",
          [](const Coupling& c) {
            std::map<std::string, double> factors;
            for (const auto& t : c.terms) factors[t.coordinate] = t.factor;
            return factors;
          },
          [](Coupling& c, const std::map<std::string, double>& factors) {
            c.terms.clear();
            for (const auto& [coordinate, factor] : factors)
              c.terms.push_back({coordinate, factor});
          },
          "By coordinate, with one degree of freedom each.")
      .def_readwrite("offset", &Coupling::offset, "In the unit of factor times coordinate.");
  py::class_<Rolling>(
      m, "Rolling",
      R"(A body that touches the plane z = 0 of the frame `ground` and does not slip. Types, by the frame `wheel`: disk (thin,
axle z), sphere, blade (no motion along z), no_spin (no turn about z). Needs a pgauss method.)")
      .def(from_keywords<Rolling>())
      .def_readwrite("name", &Rolling::name)
      .def_readwrite("type", &Rolling::type)
      .def_readwrite("ground", &Rolling::ground, "By default the world.")
      .def_readwrite("wheel", &Rolling::wheel)
      .def_readwrite("radius", &Rolling::radius, "Of a disk or sphere [m], > 0.");
  py::class_<Driven>(
      m, "Driven",
      "A joint coordinate with one degree of freedom that moves as told, by a motor of any "
      "strength; its account is '<name>.power'.")
      .def(from_keywords<Driven>())
      .def_readwrite("name", &Driven::name)
      .def_readwrite("coordinate", &Driven::coordinate)
      .def_readwrite("motion", &Driven::motion, "Angles count their turns.");
  py::class_<ClosedStart>(m, "ClosedStart", "What close_loops() found and did.")
      .def_readonly("gap", &ClosedStart::gap, "Largest gap at the start [m or rad].")
      .def_readonly("slip", &ClosedStart::slip, "Largest rate of a gap at the start [1/s].")
      .def_readonly("moved", &ClosedStart::moved, "Largest change of a coordinate [m or rad].")
      .def_readonly("sped_up", &ClosedStart::sped_up, "Largest change of a rate [m/s or rad/s].")
      .def_readonly("rank", &ClosedStart::rank, "Independent rows at the closed position.")
      .def_readonly("largest", &ClosedStart::largest,
                    "Name of the constraint with the largest gap.");
}

double value_of(const phs::FunctionPtr& f, double t) {
  if (!f)
    throw InvalidArgument("the motion is empty, expected one of steady_motion(), moves() ...");
  return (*f)(t);
}
void bind_motions(py::module_& m) {
  py::class_<phs::Motion>(m, "Motion", "A position told for every time [rad or m].")
      .def(
          "position", [](const phs::Motion& x, double t) { return value_of(x.position, t); },
          py::arg("t"))
      .def(
          "rate", [](const phs::Motion& x, double t) { return value_of(x.rate, t); }, py::arg("t"))
      .def_readonly("instants", &phs::Motion::instants,
                    "Times at which a higher derivative jumps: steps should end there [s].");
  m.def(
      "steady_motion", [](double start, double rate) { return phs::steady_motion(start, rate); },
      py::arg("start"), py::arg("rate"), "start + rate t.");
  m.def(
      "swinging_motion",
      [](double middle, double amplitude, double frequency, double phase) {
        return phs::swinging_motion(middle, amplitude, frequency, phase);
      },
      py::arg("middle"), py::arg("amplitude"), py::arg("frequency"), py::arg("phase") = 0.0,
      "middle + amplitude sin(2 pi frequency t + phase); frequency in Hz.");
  m.def(
      "moves",
      [](double start, const std::vector<std::tuple<double, double, double>>& list) {
        std::vector<phs::Move> all;
        for (const auto& [at, duration, to] : list) all.push_back({at, duration, to});
        return phs::moves_from(start, all);
      },
      py::arg("start"), py::arg("moves"),
      "Moves of least jerk with rests between, each (at, duration, to) [s, s, rad or m].");
}

/// λ and what it exerts, by name.
py::dict exerted(phs::Reactions& r, const phs::Description& d, double t, py::object x,
                 py::object turns) {
  std::vector<std::int64_t> n(size_t(d.angle_count()), 0);
  if (!turns.is_none()) n = turns.cast<std::vector<std::int64_t>>();
  if (n.size() != size_t(d.angle_count())) require_size("turns", n.size(), size_t(d.angle_count()));
  r.at(t, numbers("x", x, size_t(d.nx)), n);
  const auto all = r.exerted();
  py::dict by_name;
  size_t at = 0;
  for (const auto& c : d.constraints)
    for (const auto& one : c.reactions) {
      const auto own = all.subspan(at, size_t(one.size));
      at += own.size();
      by_name[py::str(one.name)] = one.size == 1
                                       ? py::object(py::float_(own[0]))
                                       : as_array(std::vector<double>(own.begin(), own.end()));
    }
  return by_name;
}

}  // namespace

void bind_constraints(py::module_& m) {
  bind_motions(m);
  bind_constraint_specs(m);
  py::class_<phs::Reactions>(
      m, "Reactions",
      R"(What the constraints of a model exert at a state, from the accelerations: by name, the wrench of a loop on link b (of
a rolling body on its wheel) about the origin of its frame, in the axes of a (of the ground), [moment; force] [N m; N]; the
tension of a rod [N]; the torque or force of a coupling or motor on each of its joints, '<name>.<joint>'. Where they are
not unique, those of the smallest norm.)")
      .def(py::init([](std::shared_ptr<phs::Model> model) {
             return std::make_unique<phs::Reactions>(*model);
           }),
           py::arg("model"), py::keep_alive<1, 2>(), "Raises InvalidArgument without constraints.")
      .def(
          "at",
          [](phs::Reactions& r, py::object x, double t, py::object turns) {
            return exerted(r, r.description(), t, x, turns);
          },
          py::arg("x"), py::arg("t") = 0.0, py::arg("turns") = py::none(),
          "x: the flat state, on the constraints; turns: of its angle blocks.");
}

void bind_model_constraints(MechanicalModelClass& model) {
  model
      .def(py::init([](std::shared_ptr<const Mechanism> mechanism,
                       const std::vector<BodyPort>& ports,
                       const std::vector<Constraint>& constraints) {
             return std::make_shared<MechanicalModel>(std::move(mechanism), ports,
                                                      spec_of(constraints));
           }),
           py::arg("mechanism"), py::arg("ports") = std::vector<BodyPort>{},
           py::arg("constraints") = std::vector<Constraint>{},
           "constraints: LoopJoint, Rod, Coupling, Rolling and Driven objects with names of their "
           "own.")
      .def(
          "close_loops",
          [](const MechanicalModel& p, py::object q, py::object v,
             const std::vector<std::string>& held) {
            const Mechanism& mech = p.mechanism();
            auto q_closed = numbers("q", q, size_t(mech.nq()));
            auto v_closed = numbers("v", v, size_t(mech.nv()));
            std::vector<int> rates;
            for (const auto& name : held) {
              const auto& c = mech.coordinate(name);
              for (int k = 0; k < c.nv; ++k) rates.push_back(c.v + k);
            }
            const ClosedStart found =
                mechanics::close_loops(mech, loops_of(p), q_closed, v_closed, rates);
            return py::make_tuple(as_array(std::move(q_closed)), as_array(std::move(v_closed)),
                                  found);
          },
          py::arg("q"), py::arg("v"), py::arg("held") = std::vector<std::string>{},
          "Moves a start onto the constraints: (q, v, what was found). held: coordinates that stay "
          "if the others can close the loops. Raises InvalidArgument if they cannot be closed.");
}

}  // namespace porthos::python
