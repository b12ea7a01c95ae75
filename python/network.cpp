// Systems joined through their power ports.
#include "phs/network/network.h"

#include <pybind11/stl.h>

#include "energy_shaping/foreign_law.h"
#include "phs/linear/linear_system.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"
#include "python/law.h"
#include "python/scalars.h"

namespace porthos::python {
namespace {

using namespace phs;
using py::arg;
constexpr auto chain = py::return_value_policy::reference_internal;

/// A law with a memory, law(t, x, y) of an object, on ports of one member.
SampledLawPtr object_law(const Network& n, const std::string& name,
                         const std::vector<std::string>& ports, py::object law, size_t memory) {
  if (py::isinstance<Law>(law))
    throw InvalidArgument("control '" + name +
                          "': a Law acts on one port, by its name; on a list of ports acts an "
                          "object law(t, x, y), called at the instants alone");
  std::vector<energy_shaping::LawJoint> rows;
  size_t states = 0;
  for (const auto& port : ports) {
    const auto sizes = n.sizes(port);
    states = size_t(sizes.states);
    for (int k = 0; k < sizes.inputs; ++k) rows.push_back({port, 0});
  }
  const auto address = std::to_string(reinterpret_cast<std::uintptr_t>(law.ptr()));
  const auto see = [own = keep(std::move(law))](double, std::span<const double> x,
                                                std::span<double> seen) {
    std::copy_n(x.begin(), seen.size(), seen.begin());
  };
  return energy_shaping::foreign_law(python_object_laws(), "controller '" + name + "'",
                                     std::move(rows), address, {states, see}, memory);
}

/// ["a.body", ("b.body", -1)]
std::vector<Network::End> ends_of(py::handle list) {
  std::vector<Network::End> ends;
  for (const auto& e : list) {
    if (py::isinstance<py::str>(e)) {
      ends.push_back({e.cast<std::string>(), 1});
      continue;
    }
    if (!py::isinstance<py::tuple>(e) || py::len(e) != 2)
      throw InvalidArgument("an end is " + kind_of(e) + ", expected a port's name or (name, sign)");
    const auto t = py::reinterpret_borrow<py::tuple>(e);
    ends.push_back({t[0].cast<std::string>(), int(number("sign", t[1]))});
  }
  return ends;
}

void bind_linear(py::module_& m) {
  m.def(
      "linear_system",
      [](py::object J, py::object G, py::object R, py::object Q, py::object E,
         const std::string& name) {
        LinearMatrices a;
        a.J = matrix("J", J);
        a.G = matrix("G", G);
        if (!R.is_none()) a.R = matrix("R", R);
        if (!Q.is_none()) a.Q = matrix("Q", Q);
        if (!E.is_none()) a.E = matrix("E", E);
        return std::shared_ptr<Model>(LinearSystem(std::move(a), name).to_model());
      },
      arg("J"), arg("G"), py::kw_only(), arg("R") = py::none(), arg("Q") = py::none(),
      arg("E") = py::none(), arg("name") = "linear system",
      R"(The linear port-Hamiltonian system E x' = (J - R) Q x + G u, y = G^T Q x, H = x E^T Q x / 2, as a model.

Matrices as rows; Q and E left out are the identity, R zero. What is not port-Hamiltonian is refused: matrix, entry and
size of the violation are named.)");
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_network(py::module_& m) {
  bind_linear(m);
  py::class_<Casimir>(m, "Casimir",
                      "A weighted sum of numbers of the state that keeps its value whatever H is.")
      .def_readonly("text", &Casimir::text, "'spring.elongation - arm.elbow'")
      .def_property_readonly(
          "terms",
          [](const Casimir& c) { return std::map<int, double>(c.terms.begin(), c.terms.end()); },
          "The weight of each number of the state in it.")
      .def("__repr__", [](const Casimir& c) { return "<porthos.Casimir " + c.text + ">"; });
  py::class_<NetworkModel, Model, std::shared_ptr<NetworkModel>>(
      m, "NetworkModel",
      R"(The system a Network builds. State: the members' states one after another; with one member its blocks keep their names,
with several they are prefixed '<member>.'.)")
      .def("offset", &NetworkModel::offset, arg("member"), "Where the state of a member begins.")
      .def_property_readonly("casimirs", &NetworkModel::casimirs, "The Casimirs.");

  py::class_<Network>(
      m, "Network",
      R"(Collects members and junctions, checks each as it comes, and builds the model. Ports are named
'<member>.<port>', as 'arm.elbow.torque'.

Every method raises InvalidArgument with one sentence for an unknown or ambiguous name, ports whose kinds, sizes or units
do not match, and a port that is joined already. In all u = (K - D) y + v with K skew and D + D^T >= 0.)")
      .def(py::init<std::string>(), arg("name"))
      .def(
          "add",
          [](Network& n, const std::string& name, std::shared_ptr<const Model> member) -> Network& {
            return n.add(name, std::move(member));
          },
          arg("name"), arg("member"), chain, "A member. Several of one type share their model.")
      .def("main", &Network::main, arg("name"), chain,
           "The member the others are elements of: its blocks, ledger and invariants keep their "
           "names.")
      .def("feedback", &Network::feedback, arg("effort_in"), arg("flow_in"), chain,
           "The flow of effort_in drives flow_in, whose effort acts back: u_a = -y_b, u_b = y_a.")
      .def("transformer", &Network::transformer, arg("effort_in"), arg("flow_in"), arg("ratio"),
           chain, "A gear, a lever: u_b = ratio y_a, u_a = -ratio y_b.")
      .def("gyrator", &Network::gyrator, arg("a"), arg("b"), arg("r"), chain,
           "A motor constant, a precession: of two ports of one kind, u_b = r y_a, u_a = -r y_b.")
      .def(
          "one_junction",
          [](Network& n, const std::string& name, py::object ends) -> Network& {
            return n.one_junction(name, ends_of(ends));
          },
          arg("name"), arg("ends"), chain,
          "One flow, efforts sum to zero; exactly one effort_in port sets the flow. ends: ports, "
          "or (port, sign).")
      .def(
          "zero_junction",
          [](Network& n, const std::string& name, py::object ends) -> Network& {
            return n.zero_junction(name, ends_of(ends));
          },
          arg("name"), arg("ends"), chain,
          "One effort, flows sum to zero; exactly one flow_in port sets the effort. ends: ports, "
          "or (port, sign).")
      .def(
          "couple",
          [](Network& n, const std::vector<std::string>& ports, py::object K) -> Network& {
            return n.couple(ports, matrix("K", K));
          },
          arg("ports"), arg("K"), chain,
          "u = K y over the ports one after another. InvalidArgument if K is not skew.")
      .def(
          "resist",
          [](Network& n, const std::string& name, const std::string& port,
             std::shared_ptr<Function> law,
             int component) -> Network& { return n.resist(name, port, std::move(law), component); },
          arg("name"), arg("port"), arg("law"), arg("component") = 0, chain,
          "u -= law(y) of a port of size 1, or of one component of a larger one.")
      .def(
          "resist",
          [](Network& n, const std::string& name, const std::vector<std::string>& ports,
             py::object D) -> Network& { return n.resist(name, ports, matrix("D", D)); },
          arg("name"), arg("ports"), arg("D"), chain,
          "Rayleigh damping u -= D y over the ports one after another. InvalidArgument if D + D^T "
          "is not >= 0.")
      .def(
          "lugre",
          [](Network& n, const std::string& name, const std::string& port, double coulomb,
             double breakaway, double stribeck, double viscous, double stiffness, double damping,
             int component) -> Network& {
            return n.lugre(name, port, {coulomb, breakaway, stribeck, viscous, stiffness, damping},
                           component);
          },
          arg("name"), arg("port"), py::kw_only(), arg("coulomb"), arg("breakaway") = 0.0,
          arg("stribeck") = 0.0, arg("viscous") = 0.0, arg("bristle_stiffness"),
          arg("bristle_damping") = 0.0, arg("component") = 0, chain,
          R"(Dry friction by a bristle that bends before it slips (Canudas de Wit and others 1995), at an effort_in port of size 1 or
one component of a larger one: z' = v - s0 |v| z / g(v), force = s0 z + s1 z' + viscous v, with s0 = bristle_stiffness [N/m or
N m/rad], s1 = bristle_damping and g = coulomb + (breakaway - coulomb) exp(-(v/stribeck)^2). A member `name` keeps the bend z
and stores s0 z^2 / 2; the loss is `name`.loss. Raises InvalidArgument where it would make energy: viscous less than
bristle_damping (breakaway - coulomb) / coulomb.)")
      .def(
          "source",
          [](Network& n, const std::string& name, const std::string& port,
             std::shared_ptr<Function> v,
             int component) -> Network& { return n.source(name, port, std::move(v), component); },
          arg("name"), arg("port"), arg("v"), arg("component") = 0, chain, "u += v(t).")
      .def(
          "control",
          [](Network& n, const std::string& name, const std::string& port, std::shared_ptr<Law> law,
             double period, std::vector<std::string> encoder,
             std::vector<std::string> sensors) -> Network& {
            return n.control(name, port, LawPtr(std::move(law)),
                             {period, std::move(encoder), std::move(sensors)});
          },
          arg("name"), arg("port"), arg("law"), py::kw_only(), arg("period") = 0.0,
          arg("encoder") = std::vector<std::string>{}, arg("sensors") = std::vector<std::string>{},
          chain,
          R"(A controller on a port of any size: u += kappa(t, x, y), x the state of the port's member. Its power is in the ledger as
`name`, and nothing asks it to be passive.

period [s], a whole number of steps; 0: continuously. A sampled one is held between the instants k period; `name` is then
what kappa would have supplied all the time, and `name`.hold what the hold adds. encoder: coordinates
('<member>.<block>'), it sees their mean flow over the last period. sensors: ports whose outputs kappa sees too.
kappa is a function of t, x and y alone and is called at other times too; a law that remembers something takes a list of ports.)")
      .def(
          "control",
          [](Network& n, const std::string& name, const std::vector<std::string>& ports,
             py::object law, double period, size_t memory) -> Network& {
            return n.control(name, ports, object_law(n, name, ports, std::move(law), memory),
                             period);
          },
          arg("name"), arg("ports"), arg("law"), py::kw_only(), arg("period"), arg("memory") = 0,
          chain,
          R"(A sampled controller that remembers, on ports of one member: law(t, x, y) -> u is called at the instants k period
alone, in turn, and u is held until the next. x: the state of the member, angles unwrapped; y, u: outputs and inputs of the
ports, one after another. The ledger lists its power as `name`.

law: an object whose attributes are its memory. They must be what pickle takes, or the object has __getstate__ and
__setstate__, or stateless = True. Runs use copies of it: it stays as it is, and each run begins with it. memory: bytes that it may
need; 0: twice those of the start and 4096 more. Raises InvalidArgument for ports of two members, LawFailure where the law fails.)")
      .def(
          "potential",
          py::overload_cast<const std::string&, const std::string&, Potential>(&Network::potential),
          arg("name"), arg("coordinate"), arg("U"), chain,
          "H += U(z), z a coordinate with a conjugate momentum: '<member>.<block>'.")
      .def(
          "potential",
          [](Network& n, const std::string& name, const std::string& coordinate,
             std::shared_ptr<BlockPotential> U) -> Network& {
            return n.potential(name, coordinate, std::move(U));
          },
          arg("name"), arg("coordinate"), arg("U"), chain,
          "The same for a coordinate of several numbers: an attitude, a place in space.")
      .def(
          "build",
          [](const Network& n) { return std::const_pointer_cast<NetworkModel>(n.build()); },
          R"(The system. Ports that nothing was joined to stay its ports.

Raises InvalidArgument for a required port that is not joined, an open port with feedthrough, or an algebraic loop without
a solution.)");
}

}  // namespace porthos::python
