// Mechanisms: built in Python, or read from URDF.
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "mechanics/joint_list.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "python/arrays.h"
#include "python/bind.h"
#include "python/keywords.h"

namespace porthos::python {

namespace {

using namespace mechanics;
using MechanismPtr = std::shared_ptr<Mechanism>;

std::string text_of(const Mechanism& m) {
  return fmt::format("<porthos.Mechanism '{}': {} moving bodies, nq {}, nv {}>", m.name(),
                     m.body_count(), m.nq(), m.nv());
}

void bind_specs(py::module_& m) {
  py::class_<MassProperties>(m, "MassProperties", "Mass properties of a body as users give them.")
      .def(from_keywords<MassProperties>())
      .def_readwrite("mass", &MassProperties::mass, "[kg]")
      .def_property(
          "com", [](const MassProperties& p) { return tuple_of(p.com); },
          [](MassProperties& p, py::object v) { p.com = vector3("com", v); },
          "Centre of mass in the body frame [m].")
      .def_property(
          "inertia",
          [](const MassProperties& p) {
            const auto& I = p.inertia;
            return py::make_tuple(I.xx, I.xy, I.xz, I.yy, I.yz, I.zz);
          },
          [](MassProperties& p, py::object v) {
            const auto I = numbers("inertia", v, 6);
            p.inertia = {I[0], I[1], I[2], I[3], I[4], I[5]};
          },
          "About the centre of mass, along `axes` [kg m^2], tensor elements xx, xy, xz, yy, yz, "
          "zz.")
      .def_property(
          "axes", [](const MassProperties& p) { return array_of(p.axes); },
          [](MassProperties& p, py::object v) { p.axes = matrix3("axes", v); },
          "Inertia axes in the body frame, (3, 3).");

  py::class_<JointSpec>(m, "JointSpec", "A joint as users give it.")
      .def(from_keywords<JointSpec>())
      .def_readwrite("name", &JointSpec::name, "Empty: the body's name.")
      .def_readwrite("type", &JointSpec::type, "One of joint_type_names().")
      .def_property(
          "axis", [](const JointSpec& j) { return tuple_of(j.axis); },
          [](JointSpec& j, py::object v) { j.axis = vector3("axis", v); },
          "In the joint frame; need not be unit. Ignored by spherical and free.")
      .def_property(
          "second_axis",
          [](const JointSpec& j) -> py::object {
            return j.second_axis ? py::object(tuple_of(*j.second_axis)) : py::none();
          },
          [](JointSpec& j, py::object v) {
            if (v.is_none())
              j.second_axis.reset();
            else
              j.second_axis = vector3("second_axis", v);
          },
          "universal: second rotation axis; planar: first translation.")
      .def_readwrite("pitch", &JointSpec::pitch, "helical [m/rad].")
      .def_readwrite("damping", &JointSpec::damping,
                     "Viscous [N m s/rad | N s/m], >= 0; joints of one degree of freedom only.")
      .def_readwrite("stiffness", &JointSpec::stiffness,
                     "Spring [N m/rad | N/m], >= 0; joints of one degree of freedom only.")
      .def_readwrite("rest", &JointSpec::rest, "The spring's rest coordinate [rad | m].")
      .def_readwrite("rotor_inertia", &JointSpec::rotor_inertia,
                     "Rotor (armature) inertia [kg m^2 | kg], >= 0: n^2 J of a rotor of inertia J "
                     "behind a gear of ratio n, as the joint feels it.");

  py::class_<BodySpec>(m, "BodySpec", "A body, the joint that carries it and where the joint sits.")
      .def(from_keywords<BodySpec>())
      .def_readwrite("name", &BodySpec::name)
      .def_readwrite("parent", &BodySpec::parent, "Name of another body, or 'world'.")
      .def_readwrite("joint", &BodySpec::joint)
      .def_readwrite("mass", &BodySpec::mass)
      .def_property(
          "position", [](const BodySpec& b) { return tuple_of(b.placement.r); },
          [](BodySpec& b, py::object v) { b.placement.r = vector3("position", v); },
          "Origin of the joint frame (= body frame at q = 0) in the parent's body frame [m].")
      .def_property(
          "rotation", [](const BodySpec& b) { return array_of(b.placement.R); },
          [](BodySpec& b, py::object v) { b.placement.R = matrix3("rotation", v); },
          "Axes of the joint frame in the parent's body frame, (3, 3); see rotation_from_rpy().");
  m.def(
      "rotation_from_rpy",
      [](double r, double p, double y) { return array_of(rotation_from_rpy(r, p, y)); },
      py::arg("roll"), py::arg("pitch"), py::arg("yaw"),
      "The rotation matrix of URDF's roll-pitch-yaw: Rz(yaw) Ry(pitch) Rx(roll), rounded once.");
  m.def("joint_type_names", &joint_type_names, "Names of all joint types a user may ask for.");
}

// NOLINTNEXTLINE(readability-function-size): a list of bindings
void bind_mechanism(py::module_& m) {
  py::class_<Remark>(m, "Remark", "Something noticed in the input that does not stop a run.")
      .def_readonly("where", &Remark::where, "'file:line', may be empty.")
      .def_readonly("text", &Remark::text)
      .def("__repr__", [](const Remark& r) { return in_file(r.where) + r.text; });

  py::class_<JointCoordinates>(
      m, "JointCoordinates",
      "A coordinate block: where a joint's numbers stand in q (and p) and in v (and tau).")
      .def_readonly("name", &JointCoordinates::name)
      .def_readonly("joint", &JointCoordinates::joint, "Name of the joint it belongs to.")
      .def_property_readonly(
          "q", [](const JointCoordinates& c) { return py::slice(c.q, c.q + c.nq, 1); },
          "Slice of q and p.")
      .def_property_readonly(
          "v", [](const JointCoordinates& c) { return py::slice(c.v, c.v + c.nv, 1); },
          "Slice of v and tau.")
      .def_readonly("unit", &JointCoordinates::unit)
      .def_readonly("momentum_unit", &JointCoordinates::momentum_unit)
      .def_readonly("rate_unit", &JointCoordinates::rate_unit)
      .def("__repr__", [](const JointCoordinates& c) {
        return fmt::format("<porthos.JointCoordinates '{}': q[{}:{}], v[{}:{}]>", c.name, c.q,
                           c.q + c.nq, c.v, c.v + c.nv);
      });

  py::class_<Mechanism, MechanismPtr>(
      m, "Mechanism",
      R"(An articulated mechanism: an immutable tree of bodies. Made by MechanismBuilder or read_urdf().

q = joint coordinates, v = joint rates (body-frame twists of ball and free joints, [angular; linear]),
p = momenta conjugate to q, of the same size as q.)")
      .def_property_readonly("name", &Mechanism::name)
      .def_property_readonly("nq", &Mechanism::nq)
      .def_property_readonly("nv", &Mechanism::nv)
      .def_property_readonly("body_count", &Mechanism::body_count,
                             "Moving bodies, fixed joints merged.")
      .def_property_readonly("total_mass", &Mechanism::total_mass, "Of the moving bodies [kg].")
      .def_property_readonly(
          "gravity", [](const Mechanism& p) { return tuple_of(p.gravity()); },
          "Uniform, world axes [m/s^2].")
      .def_property_readonly("coordinates", &Mechanism::coordinates)
      .def("coordinate", &Mechanism::coordinate, py::arg("name"),
           "The coordinates of the block of that name; InvalidArgument names the known ones.")
      .def_property_readonly(
          "bodies",
          [](const Mechanism& p) {
            std::vector<std::string> names;
            for (const auto& b : p.bodies()) names.push_back(b.name);
            return names;
          },
          "Names of the user's bodies.")
      .def_property_readonly("remarks", &Mechanism::remarks,
                             "Faults of the input that do not reach the dynamics or were accepted.")
      .def(
          "neutral", [](const Mechanism& p) { return as_array(p.neutral()); },
          "q with every coordinate zero and every quaternion (1, 0, 0, 0).")
      .def("__repr__", &text_of);

  py::class_<MechanismBuilder>(
      m, "MechanismBuilder",
      "Collects bodies in any order, validates, and makes the immutable Mechanism.")
      .def(py::init<std::string>(), py::arg("name") = "mechanism")
      .def(
          "add",
          [](MechanismBuilder& b, const BodySpec& s) -> MechanismBuilder& { return b.add(s); },
          py::arg("body"), py::return_value_policy::reference_internal)
      .def(
          "gravity",
          [](MechanismBuilder& b, py::object g) -> MechanismBuilder& {
            return b.gravity(vector3("gravity", g));
          },
          py::arg("g"), py::return_value_policy::reference_internal,
          "Uniform gravity, world axes [m/s^2].")
      .def("accept_unphysical_inertia", &MechanismBuilder::accept_unphysical_inertia,
           py::arg("accept"), py::return_value_policy::reference_internal,
           "Takes inertias that are positive but break the triangle inequality, as some published "
           "robots have; each becomes a remark. Off by default.")
      .def(
          "build", [](const MechanismBuilder& b) { return std::make_shared<Mechanism>(b.build()); },
          R"(The mechanism.

Raises InvalidArgument naming the offender: duplicate or unknown names, a cycle, a negative or non-finite mass, an
inertia that is not positive or breaks the triangle inequality, a zero axis, an unknown joint type, a moving part
without inertia about its joint, negative damping or stiffness.)");
}

struct Urdf {
  MechanismPtr mechanism;
  std::vector<UrdfNote> notes;
  std::string root_link;
};

/// With a note where a fixed base has no gravity by default.
Urdf urdf(const UrdfResult& r, const std::string& file, const std::string& base,
          py::object gravity) {
  Urdf u{std::make_shared<Mechanism>(r.mechanism), r.notes, r.root_link};
  if (base == "fixed" && gravity.is_none())
    u.notes.push_back({file,
                       "there is no gravity, for none is stated: expected gravity=(0, 0, "
                       "-9.81), or (0, 0, 0) where that is meant"});
  return u;
}

UrdfOptions options_of(const std::string& base, py::object gravity, bool massless,
                       const std::map<std::string, double>& rotor_inertia, bool accept,
                       bool use_damping) {
  UrdfOptions o;
  if (base != "fixed" && base != "free")
    throw InvalidArgument("base is '" + base + "', expected 'fixed' or 'free'");
  o.base = base == "free" ? UrdfOptions::Base::free : UrdfOptions::Base::fixed;
  if (!gravity.is_none()) o.gravity = vector3("gravity", gravity);
  if (massless) o.links_without_inertia = UrdfOptions::NoInertia::massless;
  o.rotor_inertia = rotor_inertia;
  o.accept_unphysical_inertia = accept;
  o.use_damping = use_damping;
  return o;
}

void bind_urdf(py::module_& m) {
  py::class_<Urdf>(m, "UrdfResult")
      .def_readonly("mechanism", &Urdf::mechanism)
      .def_readonly(
          "notes", &Urdf::notes,
          "Unknown tags and attributes, mimic, limits, friction, ignored geometry counts.")
      .def_readonly("root_link", &Urdf::root_link);
  const std::map<std::string, double> no_rotors;
  const char* const options =
      R"(Reads a mechanism from {}.

base: 'fixed' or 'free', how the root link is carried. gravity: world axes [m/s^2], by default none,
of which a note tells where the base is fixed. massless_links: a link without
<inertial> is a massless frame instead of an error. rotor_inertia: [kg m^2 | kg] by joint name. use_damping: <dynamics
damping> becomes viscous joint damping. Raises InvalidArgument 'file:line: ...' for a missing file, broken XML, missing or malformed
numbers, unknown joint types, several root links, cycles, and everything MechanismBuilder refuses.)";
  static const std::string of_file = fmt::format(fmt::runtime(options), "a URDF file"),
                           of_text = fmt::format(
                               fmt::runtime(options),
                               "the text of a URDF file; `name` stands for the file in messages");
  m.def(
      "read_urdf",
      [](py::object path, const std::string& base, py::object gravity, bool massless,
         const std::map<std::string, double>& rotors, bool accept, bool damping) {
        const std::string file = py::str(path);
        const auto o = options_of(base, gravity, massless, rotors, accept, damping);
        return urdf(read_urdf(file, o), file, base, gravity);
      },
      py::arg("path"), py::kw_only(), py::arg("base") = "fixed", py::arg("gravity") = py::none(),
      py::arg("massless_links") = false, py::arg("rotor_inertia") = no_rotors,
      py::arg("accept_unphysical_inertia") = false, py::arg("use_damping") = true, of_file.c_str());
  m.def(
      "parse_urdf",
      [](const std::string& text, const std::string& name, const std::string& base,
         py::object gravity, bool massless, const std::map<std::string, double>& rotors,
         bool accept, bool damping) {
        const auto o = options_of(base, gravity, massless, rotors, accept, damping);
        return urdf(parse_urdf(text, name, o), name, base, gravity);
      },
      py::arg("text"), py::arg("name") = "<text>", py::kw_only(), py::arg("base") = "fixed",
      py::arg("gravity") = py::none(), py::arg("massless_links") = false,
      py::arg("rotor_inertia") = no_rotors, py::arg("accept_unphysical_inertia") = false,
      py::arg("use_damping") = true, of_text.c_str());
}

}  // namespace

void bind_mechanics(py::module_& m) {
  bind_specs(m);
  bind_mechanism(m);
  bind_urdf(m);

  py::class_<BodyPort>(
      m, "BodyPort",
      R"(A power port on a body: a frame fixed to a link, with the link's axes. Port '<name>.wrench', 6 numbers each way:
u = [moment; force] on the link about the frame's origin [N m; N]; y = twist [angular; linear] of the frame [rad/s; m/s].)")
      .def(from_keywords<BodyPort>())
      .def_readwrite("name", &BodyPort::name)
      .def_readwrite("link", &BodyPort::link, "Any moving body, one on a fixed joint too.")
      .def_property(
          "position", [](const BodyPort& p) { return tuple_of(p.position); },
          [](BodyPort& p, py::object v) { p.position = vector3("position", v); },
          "Origin in the link's frame [m].");

  bind_constraints(m);
  MechanicalModelClass model(m, "MechanicalModel",
                             R"(A mechanism as a port-Hamiltonian system: x = (q, p), canonical J,

    H = p M(q)^-1 p / 2 + V_gravity(q) + sum k (q_j - rest)^2 / 2,   R = diag(0, joint damping).

Ports, one per joint: '<joint>.torque', '<joint>.force', '<joint>.wrench' (several degrees of freedom), then the body ports.
Invariants: linear and angular momentum of mechanisms free in the world without gravity, and of every quaternion.)");
  bind_model_constraints(model);
  model
      .def_property_readonly("mechanism",
                             [](const std::shared_ptr<MechanicalModel>& p) {
                               return std::shared_ptr<Mechanism>(
                                   p, const_cast<Mechanism*>(&p->mechanism()));
                             })
      .def(
          "state",
          [](const MechanicalModel& p, py::object q, py::object v) {
            const auto& mech = p.mechanism();
            return as_array(
                p.state(numbers("q", q, size_t(mech.nq())), numbers("v", v, size_t(mech.nv()))));
          },
          py::arg("q"), py::arg("v"), "The flat state x of coordinates q and joint rates v.")
      .def(
          "rates",
          [](const MechanicalModel& p, py::object x, py::object turns) {
            const size_t angles = size_t(p.mechanism().angle_count());
            std::vector<std::int64_t> n(angles, 0);
            if (!turns.is_none()) n = turns.cast<std::vector<std::int64_t>>();
            if (n.size() < angles) require_size("turns", n.size(), angles);
            return as_array(p.rates(numbers("x", x, size_t(2 * p.mechanism().nq())), n));
          },
          py::arg("x"), py::arg("turns") = py::none(),
          "Joint rates of a flat state. turns: of its angle blocks, as State.turns; None: they "
          "stand in the angles.");
}

}  // namespace porthos::python
