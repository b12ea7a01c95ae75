#include "scene/read/schema.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "integrators/integrator.h"
#include "scene/read/elements/element_type.h"
#include "scene/read/scene.h"
#include "scene/read/schema_keys-inl.h"
#include "vsa/catalogue.h"

namespace porthos::scene {
namespace {

using namespace keys;

Keys motion(bool of_body) {
  return {numbers("position", 3, "m", "[0, 0, 0]", "in the world"),
          numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]", "quaternion to the world; normalised"),
          numbers("linear_velocity", 3, "m/s", "[0, 0, 0]",
                  of_body ? "of its origin, in world axes" : "of the base's origin, in world axes"),
          numbers("angular_velocity", 3, "rad/s", "[0, 0, 0]", "body rates, in its own axes")};
}

Keys mass(const std::string& inertia) {
  return {number("mass", "kg", required, "0 or more"),
          numbers("com", 3, "m", "[0, 0, 0]", "centre of mass in its frame"),
          numbers("inertia", 6, "kg m²", inertia,
                  "[ixx, iyy, izz, ixy, ixz, iyz] about the centre of mass")};
}

/// waits: something may take the place of a time.
SchemaTable event(const char* type, const char* what, bool waits, const Keys& own) {
  return {fmt::format("event.{}", type), fmt::format("[[event]] type = \"{}\"", type), what,
          joined({word("type", {type}, required, "what happens"),
                  number("at", "s", waits ? "required, unless it waits" : required,
                         "when, a whole number of steps")},
                 own)};
}
/// Of events that may wait until their limits hold.
Keys reaching() {
  return {
      word("when", {"within_reach"}, "it does not wait", "instead of at: until all limits hold"),
      number("after", "s", "0", "it waits from then on"),
      number("reach", "m", required, "largest distance of the points"),
      number("speed", "m/s", "any", "largest speed of the points"),
      number("rate", "rad/s", "any", "largest relative rate")};
}

Keys drive() {
  return {
      number("start", "rad", "θ: the joint's angle; σ: required",
             "start value; of σ in its own unit"),
      word("drive", {"fixed", "torque", "position", "rate", "servo"}, required, "what moves it"),
      signal_table("command", "required but for fixed", "torque [N m], rate or position"),
      number("inertia", "kg m²", "required by torque and position", "of the rotor"),
      number("gear", "1", "1", "turns of the rotor per turn of the output"),
      number("viscous", "N m s/rad", "0", "friction of the rotor"),
      number("coulomb", "N m", "none", "friction of the gear at its output, with smoothing"),
      number("smoothing", "rad/s", "none", "over this rate the friction turns round"),
      number("kp", "N m/rad", "required by position", "of the position controller"),
      number("kd", "N m s/rad", "required by position", "of the position controller"),
      numbers("servo", 3, "", "required by servo", "[p1, p2, p3] of the filter"),
      number("torque_limit", "N m", "none", "smooth: L tanh(wish / L)"),
      number("rate_limit", "rad/s", "none", "a brake beyond this rate"),
      word("gyroscopics", {"neglected"}, "\"neglected\"", "the rotor's gyroscopic moment")};
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const auto& d : integrators::catalogue()) names.push_back(d.name);
  names.push_back(auto_method);
  return names;
}

std::vector<std::string> family_names() {
  std::vector<std::string> names;
  for (const auto& f : vsa::families()) names.push_back(f.name);
  return names;
}

std::vector<SchemaTable> top() {
  return {
      {"scene",
       "The file",
       "Its tables; docs/scene.md explains them with a task each.",
       {text("title", "the file's name", "text for people"),
        table("model", "model", required, "the mechanism"),
        table("environment", "environment", "no gravity", "gravity on the ground"),
        table("initial", "initial", "at rest at 0", "start values"),
        table("body", "body", "none", "bodies besides the model, free in the world",
              KeyKind::tables),
        table("panel", "panel", "none", "flexible panels", KeyKind::tables),
        table("element", "element", "none", "things at joints and links", KeyKind::tables),
        table("actuator", "actuator", "none", "actuators with a spring", KeyKind::tables),
        table("event", "event", "none", "changes of the mechanism", KeyKind::tables),
        table("planet", "planet", "Earth", "of a spacecraft in orbit"),
        table("orbit", "orbit", "none", "of the centre of mass"),
        table("integrator", "integrator", required, "method and step"),
        table("monitor", "monitor", "none", "watches the balance at every step"),
        table("run", "run", required, "how long, and what is recorded"),
        table("verify", "verify", "energy 1e-9, momenta 1e-10, norms 1e-12",
              "limits of a passing run"),
        table("ensemble", "ensemble", "none", "many runs, for porthos ensemble")}},
      {"model",
       "[model]",
       "The mechanism.",
       {text("urdf", required, "URDF file, relative to the scene file"),
        word("base", {"free", "fixed"}, required, "how the root link is carried"),
        {"lock", KeyKind::texts, "", "none", "joints held where they start, as if fixed"},
        word("links_without_inertia", {"error", "massless"}, "\"error\"",
             "what a moving link without <inertial> is, but on a fixed joint (a frame)"),
        word("unphysical_inertia", {"error", "accept"}, "\"error\"",
             "inertias that break the triangle inequality"),
        yes_or_no("use_damping", "true", "simulate <dynamics damping>"),
        table("inertia", "model.inertia", "none",
              "by link: mass properties of links the file gives none", KeyKind::named),
        {"mass_factor",
         KeyKind::named,
         "1",
         "none",
         "by link: times its mass and inertia",
         {},
         1}}},
      {"model.inertia", "[model.inertia.<link>]", "Mass properties of a link.", mass("all 0")},
      {"environment",
       "[environment]",
       "Gravity on the ground.",
       {word("gravity", {"none", "uniform"}, "\"none\"", "which there is"),
        numbers("vector", 3, "m/s²", "required by uniform", "in world axes"),
        numbers("magnetic_field", 3, "T", "none", "constant, in world axes, for torquers")}},
      {"initial",
       "[initial]",
       "Start values.",
       {table("base", "initial.base", "at rest at the origin", "of a free base"),
        table("joints", "initial.joints", "all 0", "by joint", KeyKind::named),
        table("random", "initial.random", "none", "of the joints that are not named")}},
      {"initial.base", "[initial.base]", "Start of a free base.", motion(false)},
      {"initial.joints",
       "[initial.joints.<joint>]",
       "Start of a joint of one freedom, or of a ball or free joint.",
       {axes("position", "rad or m", "coordinate; of a free joint 3 numbers, in its frame"),
        number("velocity", "rad/s or m/s", "0", "its rate, of a joint of one freedom"),
        numbers("attitude_wxyz", 4, "1", "[1, 0, 0, 0]",
                "quaternion child to joint frame, of a ball or free joint; normalised"),
        numbers("linear_velocity", 3, "m/s", "[0, 0, 0]",
                "of a free joint, in the axes of its frame"),
        numbers("angular_velocity", 3, "rad/s", "[0, 0, 0]",
                "of a ball or free joint, in the child's own axes")}},
      {"initial.random",
       "[initial.random]",
       "Uniform random start values.",
       {whole("seed", "1", "equal seeds give equal numbers on every machine"),
        number("joint_position", "rad or m", "0", "bound of the positions"),
        number("joint_velocity", "rad/s or m/s", "0", "bound of the rates")}},
      {"integrator",
       "[integrator]",
       "Method and step.",
       {word("method", method_names(), "\"gauss16\"", "a name of porthos methods, or auto"),
        number("step", "s", "required but for auto", "step size"),
        number("target_energy_error", "1", "[verify] energy, else 1e-9",
               "of auto: relative, of the whole run"),
        number("rtol", "1", "1e-12", "of methods that work to a tolerance"),
        number("iteration_tolerance", "1", "0", "sweeps stop there; 0: at rounding"),
        word("step_control", {"fixed", "time_transformed", "reversible"}, "\"fixed\"",
             "steps that follow the motion"),
        number("step_control_rate", "rad/s", "1 / step", "steps shrink from this rate on"),
        number("step_control_length", "m", "linear rates do not count",
               "length by which they do")}},
      {"monitor",
       "[monitor]",
       "Watches the energy balance at every step.",
       {number("limit", "1", "not watched", "of the defect since the start"),
        number("step_limit", "1", "not watched", "of what one step adds to it"),
        word("action", {"warn", "stop", "repeat"}, "\"warn\"", "beyond a limit"),
        yes_or_no("project", "false", "after each step onto the energy of the ledger")}},
      {"run",
       "[run]",
       "How long, and what is recorded.",
       {number("duration", "s", required, "simulated time"),
        number("record_every", "s", "duration / 1000", "between records, in whole steps"),
        word("extrema", {"none", "state", "all"}, "\"none\"",
             "smallest and largest values between records"),
        number("checkpoint_every", "s", "60", "wall-clock time between checkpoints")}},
      {"verify",
       "[verify]",
       "Largest errors of a passing run; an absent key is not checked.",
       {number("energy", "1", "not checked", "relative"),
        number("linear_momentum", "1", "not checked", "relative"),
        number("angular_momentum", "1", "not checked", "relative; in orbit less the impulses"),
        number("quaternion_norm", "1", "not checked", "of a quaternion's length"),
        number("balance", "1", "not checked",
               "defect at the end, relative to what was turned over"),
        number("symmetry", "1", "1e-9 in porthos verify", "forth and back"),
        number("step_halving", "1", "1e-3 where nothing else tells", "what half the step changes"),
        number("orbital", "1", "not checked", "orbital ledger, relative"),
        number("coupling", "1", "not checked", "coupling ledger, relative")}},
      {"ensemble",
       "[ensemble]",
       "Many runs of one scene.",
       {whole("cases", "required, or table", "how many"),
        whole("seed", "1", "equal seeds give equal cases"),
        word("sampling", {"random", "sobol"}, "\"random\"", "independent, or evenly spread"),
        table("vary", "", "required, or table", "by key of the scene: a distribution",
              KeyKind::named),
        text("table", "none", "CSV file of cases, instead")}}};
}

std::vector<SchemaTable> parts() {
  std::vector<SchemaTable> all{
      {"body", "[[body]]", "A body besides the model, free in the world.",
       joined(joined({text("name", required, "its name")}, mass(required)), motion(true))},
      {"pulses",
       "pulses",
       "Even pulses of a thruster.",
       {number("start", "s", "0", ""), number("period", "s", required, ""),
        number("width", "s", required, ""), whole("count", required, "how many")}},
      {"panel",
       "[[panel]]",
       "A flexible panel or boom on a link, as rigid segments on sprung hinges.",
       {text("name", required, "of its hinges too"), text("link", required, "that carries it"),
        numbers("at", 3, "m", "[0, 0, 0]", "root in the link's frame"),
        numbers("along", 3, "1", "[1, 0, 0]", "direction of its length"),
        numbers("hinge_axis", 3, "1", "[0, 1, 0]", "it bends about"),
        number("length", "m", required, ""), number("width", "m", "0", "along the hinge axis"),
        number("mass", "kg", required, ""), number("bending_stiffness", "N m²", required, "E I"),
        whole("segments", "8", "1 to 1000"),
        number("damping_ratio", "1", "0", "of the first bending")}},
      event("capture", "A free body is welded to a link.", true,
            joined({text("body", required, "of [[body]]"), text("link", required, "of the model"),
                    numbers("on_body", 3, "m", "[0, 0, 0]", "points that meet"),
                    numbers("on_link", 3, "m", "[0, 0, 0]", "")},
                   reaching())),
      event("release", "It becomes free.", false, {text("body", required, "that was caught")}),
      event("lock", "A joint stops where it is.", true,
            {text("joint", required, "its name"),
             number("above", "rad or m", "it does not wait", "instead of at: once it is there"),
             number("below", "rad or m", "it does not wait", "likewise"),
             number("after", "s", "0", "it waits from then on")}),
      event("unlock", "It can move again.", false, {text("joint", required, "its name")}),
      event("engage", "A soft latch takes hold of its body as it is.", true,
            joined({text("latch", required, "name of a soft latch")}, reaching())),
      event("disengage", "It lets go.", false, {text("latch", required, "name of a soft latch")}),
      {"actuator",
       "[[actuator]]",
       "An actuator with a spring between a joint and its motors.",
       {text("joint", required, "coordinate, as porthos info names it"),
        text("name", "<joint>.actuator", "name in the ledger"),
        text("device", "one of the three", "a name of porthos actuators"),
        word("family", family_names(), "one of the three", "a family, with parameters"),
        table("parameters", "", "the family's", "see docs/actuators.md"),
        text("table", "one of the three", "CSV file: deflection, sigma, torque"),
        table("limits", "actuator.limits", "the device's", ""),
        table("theta", "actuator.drive", required, "what moves the equilibrium"),
        table("sigma", "actuator.drive", "required where there is one", "what moves the stiffness"),
        number("damping", "N m s/rad", "0", "beside the spring"),
        signal_table("damper", "none", "variable damper to the base [N m s/rad]"),
        number("damper_limit", "N m s/rad", "none", "it is held between 0 and this")}},
      {"actuator.limits",
       "[actuator.limits]",
       "Where the spring's stops begin.",
       {number("deflection", "rad", "the device's", ""),
        number("stop_stiffness", "N m/rad²", "the device's", ""),
        numbers("sigma", 2, "unit of σ", "the device's", "[lower, upper]"),
        number("sigma_stop_stiffness", "J/σ³", "the device's", "")}},
      {"actuator.drive", "[actuator.theta], [actuator.sigma]", "A motor.", drive()},
      {"signal", "A signal", "A table with one of three keys.", signal_keys("the signal's")},
      {"sine",
       "sine",
       "amplitude · sin(2π · frequency · t + phase)",
       {number("amplitude", "the signal's", required, ""), number("frequency", "Hz", required, ""),
        number("phase", "rad", "0", "")}},
      {"profile",
       "profile",
       "Straight between points of time.",
       {list("times", "s", required, "increasing"),
        list("values", "the signal's", required, "as many")}},
      {"planet",
       "[planet]",
       "What is orbited.",
       {number("mu", "m³/s²", "Earth's", "gravitational parameter"),
        number("radius", "m", "Earth's", "equatorial"),
        numbers("axis", 3, "1", "[0, 0, 1]", "of symmetry and rotation"),
        {"harmonics", KeyKind::numbers, "1", "\"none\"", "J2 to J6", {"none", "earth"}, 5},
        number("rotation_rate", "rad/s", "not given", "drag and a tilted dipole need it"),
        table("magnetic", "planet.magnetic", "none", "a dipole, for torquers")}},
      {"planet.magnetic",
       "[planet.magnetic]",
       "A dipole that turns with the planet.",
       {number("equator", "T", required, "field at its equator"), number("tilt", "rad", "0", ""),
        number("longitude", "rad", "0", "of its north at the start")}},
      {"orbit",
       "[orbit]",
       "Of the centre of mass: altitude, elements, or position and velocity.",
       {number("altitude", "m", "one of the ways", "of a circle"),
        number("semi_major_axis", "m", "one of the ways", ""),
        number("eccentricity", "1", "0", "below 1"), number("inclination", "rad", "0", ""),
        number("node", "rad", "0", ""), number("argument", "rad", "0", "of the pericentre"),
        number("true_anomaly", "rad", "0", ""), numbers("position", 3, "m", "one of the ways", ""),
        numbers("velocity", 3, "m/s", "with position", ""),
        yes_or_no("bound", "true", "refuse what is hyperbolic or meets the surface"),
        text("splitting", "\"lobatto4c\"",
             "strang, lobatto4, lobatto6, lobatto8, the same with a c (corrected), or aba864"),
        number("sun_longitude", "rad", "no Sun", "mean, at the start"),
        number("moon_longitude", "rad", "no Moon", "mean, at the start"),
        text("epoch", "none", "date and time of UTC: Sun and Moon by ephemeris"),
        yes_or_no("sun", "true", "with an epoch"), yes_or_no("moon", "true", "with an epoch"),
        table("plates", "orbit.plates", "none", "of links, under drag and sunlight",
              KeyKind::tables),
        table("drag", "orbit.drag", "none", "exponential atmosphere"),
        table("sunlight", "orbit.sunlight", "none", "radiation pressure")}},
      {"orbit.drag",
       "[orbit.drag]",
       "An exponential atmosphere that turns with the planet.",
       {number("density", "kg/m³", required, "at altitude"), number("altitude", "m", required, ""),
        number("scale_height", "m", required, ""),
        number("area_coefficient", "m²", "required without plates",
               "area times drag coefficient")}},
      {"orbit.plates",
       "[[orbit.plates]]",
       "A flat part of a link's surface; both sides of a panel are two.",
       {text("link", required, "of the model"), number("area", "m²", required, ""),
        numbers("normal", 3, "1", required, "outward, in the link's frame"),
        numbers("place", 3, "m", "[0, 0, 0]", "centre of pressure, in the link's frame"),
        number("drag_coefficient", "1", "0", "of its area across the stream"),
        number("specular", "1", "0", "share of light that is mirrored"),
        number("diffuse", "1", "0", "share of light that is scattered")}},
      {"orbit.sunlight",
       "[orbit.sunlight]",
       "On a sphere, with a cylindrical shadow.",
       {number("area_coefficient", "m²", "required without plates", "area times coefficient"),
        number("pressure", "N/m²", "4.56e-6", "at one astronomical unit")}}};
  return all;
}

}  // namespace

const std::vector<SchemaTable>& schema() {
  static const std::vector<SchemaTable> all = [] {
    auto a = top();
    for (const ElementType& t : element_types()) a.push_back(t.table());
    const auto b = parts();
    a.insert(a.end(), b.begin(), b.end());
    return a;
  }();
  return all;
}

const SchemaTable* schema_of(const std::string& id) {
  for (const SchemaTable& t : schema())
    if (t.id == id) return &t;
  return nullptr;
}

const SchemaKey& SchemaTable::key(const std::string& name) const {
  for (const SchemaKey& k : keys)
    if (k.name == name) return k;
  throw std::logic_error(fmt::format("the schema of {} has no key '{}'", heading, name));
}

std::string of_unit(const SchemaKey& key) {
  if (key.unit.empty() || key.unit == "1") return "";
  if (key.unit == "s") return " of seconds";
  if (key.unit == "m") return " of metres";
  if (key.unit == "T") return " of tesla";
  std::string text = " of " + key.unit;
  for (const auto& [sign, word] :
       {std::pair{" (", " or "}, {")", ""}, {"²", "^2"}, {"³", "^3"}, {"Ω", "Ohm"}})
    for (size_t at; (at = text.find(sign)) != text.npos;)
      text.replace(at, std::string_view(sign).size(), word);
  return text;
}

}  // namespace porthos::scene
