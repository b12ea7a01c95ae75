#include "tests/combinations/features.h"

#include <map>
#include <stdexcept>

namespace porthos::test::combinations {
namespace {

std::string link(const std::string& name, const std::string& mass, const std::string& inertia,
                 const std::string& z) {
  return "<link name='" + name + "'><inertial><origin xyz='0 0 " + z + "'/><mass value='" + mass +
         "'/><inertia " + inertia + " ixy='0' ixz='0' iyz='0'/></inertial></link>\n";
}
std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& place, const std::string& axis) {
  return "<joint name='" + name + "' type='continuous'><origin xyz='" + place +
         "'/><parent link='" + parent + "'/><child link='" + child + "'/><axis xyz='" + axis +
         "'/></joint>\n";
}
const std::string round = "ixx='0.02' iyy='0.02' izz='0.03'";

/// A bus with an arm of two links.
std::string arm() {
  return link("bus", "10", "ixx='1.1' iyy='0.8' izz='0.6'", "0.1") +
         link("upper", "2", "ixx='0.1' iyy='0.1' izz='0.02'", "-0.3") +
         link("lower", "1", "ixx='0.05' iyy='0.05' izz='0.01'", "-0.3") +
         joint("joint1", "bus", "upper", "0 0 -0.5", "0 1 0") +
         joint("joint2", "upper", "lower", "0 0 -0.6", "1 0 0");
}

const Settings free_base{{"model.base", "'free'"}}, fixed_base{{"model.base", "'fixed'"}};
const Settings in_orbit{{"model.base", "'free'"}, {"orbit.altitude", "5e5"}};

std::string element(const std::string& type, const std::string& keys,
                    const std::string& at = "joint = 'joint@'") {
  return "[[element]]\ntype = '" + type + "'\n" + at + "\n" + keys + "\n";
}
std::string actuator(const std::string& theta) {
  return "[[actuator]]\njoint = 'joint@'\nfamily = 'series_elastic'\nparameters = { k = 20 }\n"
         "theta = { " +
         theta + " }\n";
}
std::string body(const std::string& position, const std::string& velocity) {
  return "[[body]]\nname = 'target@'\nmass = 2\ninertia = [0.2, 0.3, 0.4, 0, 0, 0]\nposition = " +
         position + "\nlinear_velocity = " + velocity + "\nangular_velocity = [0.1, 0.3, 0]\n";
}
std::string event(const std::string& type, const std::string& keys) {
  return "[[event]]\ntype = '" + type + "'\n" + keys + "\n";
}
Settings method(const std::string& name) { return {{"integrator.method", "'" + name + "'"}}; }
/// A step and an energy error that a low order can keep, and what it keeps by its structure.
Settings modest(const std::string& step, const std::string& energy) {
  return {
      {"integrator.step", step}, {"verify.energy", energy}, {"verify.linear_momentum", "1e-10"}};
}

const std::string latch =
    element("soft_latch", "stiffness = 20\nturning_stiffness = 2\ndamping = 2", "name = 'latch@'");

std::vector<Feature> all() {
  const std::string near_by = body("[0.4, 0.3, -2]", "[0.1, 0, 0.2]"),
                    coming = body("[2, 0, 0]", "[-3, 0, 0]");
  return {
      {"fixed base", {"base", "ground"}, fixed_base},
      {"free base", {"base"}, free_base},
      {"uniform gravity",
       {"gravity"},
       {{"environment.gravity", "'uniform'"}, {"environment.vector", "[0, 0, -9.81]"}}},
      {"orbit", {"[orbit]"}, {{"orbit.altitude", "5e5"}}, free_base},
      {"drag",
       {"drag"},
       {{"orbit.drag",
         "{ density = 1e-12, altitude = 5e5, scale_height = 6e4, area_coefficient = 4 }"},
        {"planet.rotation_rate", "7.29e-5"}},
       in_orbit},
      {"Sun pressure",
       {"sunlight"},
       {{"orbit.sunlight", "{ area_coefficient = 2 }"}, {"orbit.sun_longitude", "0.3"}},
       in_orbit},
      {"Moon", {"moon"}, {{"orbit.moon_longitude", "1.1"}}, in_orbit},

      {"spring", {"spring"}, {}, {}, element("spring", "stiffness = 2")},
      {"damper", {"damper"}, {}, {}, element("damper", "damping = 0.3")},
      {"friction",
       {"friction"},
       {},
       {},
       element("friction", "coulomb = 0.02\nviscous = 0.02\nsmoothing = 0.2")},
      {"dry friction",
       {"dry friction", "dry_friction"},
       {},
       {},
       element("dry_friction", "coulomb = 1.2\nbreakaway = 1.6\nstribeck = 0.3\nviscous = 0.02")},
      {"lugre",
       {"lugre"},
       {},
       {{"verify.energy", "1e-5"}},  // its force has a kink where the joint turns round
       element("lugre",
               "coulomb = 0.1\nbreakaway = 0.15\nstribeck = 0.3\nviscous = 0.05\n"
               "bristle_stiffness = 2\nbristle_damping = 0.1")},
      {"limits",
       {"limits"},
       {},
       {{"verify.energy", "1e-5"}},  // its force has a kink: docs/ports.md
       element("limits", "lower = -1\nupper = 0.35\nstiffness = 20")},
      {"force", {"force"}, {}, {}, element("force", "sine = { amplitude = 0.5, frequency = 0.7 }")},
      {"force of a file",
       {"force", "file"},
       {},
       {},
       element("force", "file = { path = 'push.csv', value = 'force' }")},
      {"force of pieces",
       {"force", "pieces"},
       {},
       {},
       element("force",
               "pieces = { period = 0.1, nodes = 2, values = [0.5, 0.2, -0.3, 0.1, 0, 0.4] }")},
      {"dc_motor",
       {"dc_motor"},
       {},
       {},
       element("dc_motor",
               "inductance = 0.2\nresistance = 1\nconstant = 0.3\ngear = 2\nrotor_inertia = 0.01\n"
               "voltage = { constant = 1 }")},
      {"controller",
       {"controller"},
       {},
       {},
       element("controller", "target = 0.1\nstiffness = 3\ndamping = 0.5")},
      {"sampled controller",
       {"controller", "sampled"},
       {},
       {},
       element("controller", "target = 0.1\nstiffness = 3\ndamping = 0.5\nrate = 10")},
      {"wheel",
       {"wheel"},
       {},
       free_base,
       element("wheel", "gain = 0.2", "joint = 'wheel'"),
       link("wheel", "0.5", round, "0") + joint("wheel", "bus", "wheel", "0 0.2 0.3", "0 0 1")},
      {"cmg",
       {"cmg"},
       {},
       {},
       element("cmg", "wheel = 'rotor'\ngain = 2\nconstant = 0.3", "joint = 'gimbal'") +
           "[initial.joints.rotor]\nvelocity = 20\n",
       link("gimbal", "0.1", "ixx='0.01' iyy='0.01' izz='0.01'", "0") +
           link("rotor", "0.5", round, "0") +
           joint("gimbal", "bus", "gimbal", "0.2 0 0.3", "1 0 0") +
           joint("rotor", "gimbal", "rotor", "0 0 0", "0 0 1")},
      {"ball joint",
       {"ball"},
       {},
       {},
       element("spring", "name = 'ball@'\nstiffness = 2", "joint = 'wrist@'") +
           element("damper", "name = 'ball@.damper'\ndamping = 0.3", "joint = 'wrist@'") +
           element("force", "name = 'ball@.force'\nsine = { amplitude = 0.3, frequency = 0.7 }",
                   "joint = 'wrist@.about_x'") +
           "[initial.joints.wrist@]\nattitude_wxyz = [0.9, 0.3, 0.2, 0.1]\n"
           "angular_velocity = [0.4, -0.2, 0.5]\n",
       link("paddle@", "0.6", "ixx='0.03' iyy='0.02' izz='0.02'", "-0.1") +
           "<joint name='wrist@' type='spherical'><origin xyz='0.1 0 -0.6'/><parent "
           "link='lower'/><child link='paddle@'/></joint>\n"},
      {"wrench",
       {"wrench"},
       {},
       {},
       element("wrench",
               "name = 'wrench@'\nat = [0.3, 0.1, 0]\naxes = 'world'\n"
               "force = { direction = [0, 1, 0.2], sine = { amplitude = 2, frequency = 0.7 } }\n"
               "moment = { direction = [1, 0, 0], constant = 0.1 }",
               "link = 'lower'")},
      {"thruster",
       {"thruster"},
       {},
       {},
       element("thruster",
               "name = 'thruster@'\nat = [0.3, 0.1, 0]\ndirection = [0, 1, 0.2]\nthrust = 2\n"
               "switches = [0.1, 0.4]",
               "link = 'lower'")},
      {"torquer",
       {"torquer"},
       {},
       {{"environment.magnetic_field", "[0, 1e-5, 3e-5]"}, {"model.base", "'free'"}},
       element("torquer", "direction = [1, 0, 0]\nconstant = 200", "name = 'torquer@'")},
      {"soft_latch", {"latch"}, {}, {}, latch + "link = 'lower'\nbody = 'upper'\n"},
      {"line_spring",
       {"line_spring"},
       {},
       {},
       element("line_spring",
               "body = 'lower'\non_body = [0, 0.2, -0.5]\nstiffness = 30\nrest = 0.8",
               "name = 'tether@'\nlink = 'bus'")},

      {"contact",
       {"contact", "bumper"},
       {},
       {},
       "[[contact]]\nname = 'bumper@'\nlinks = ['lower']\nagainst = ['bus']\n"
       "shape = { kind = 'sphere', radius = 0.2, at = [0, 0, -0.5] }\n"
       "against_shape = { kind = 'sphere', radius = 0.4, at = [0.5, 0.3, -1.2] }\n"
       "stiffness = 20\nwidth = 0.3\nloss = 0.1\nfriction = 0.2\ncreep = 1\n"},
      {"joint_stop",
       {"joint_stop"},
       {},
       {},
       element(
           "joint_stop",
           "law = 'power'\nlower = -1\nupper = 0.35\nstiffness = 50\nexponent = 2\nloss = 0.1")},

      {"rigid contact",
       {"contact", "striker"},
       {},
       {},
       "[[contact]]\nname = 'striker@'\nlinks = ['lower']\nagainst = ['bus']\n"
       "shape = { kind = 'sphere', radius = 0.2, at = [0, 0, -0.5] }\n"
       "against_shape = { kind = 'sphere', radius = 0.3, at = [0.5, 0.3, -1.2] }\n"
       "law = 'rigid'\nrestitution = 0.7\nfriction = 0.3\n" +
           element("joint_stop", "law = 'rigid'\nlower = -1\nupper = 0.35\nrestitution = 0.6")},
      {"law over joints",
       {"law"},
       {},
       {},
       "[[controller]]\ntype = 'potential'\nname = 'law@'\n"
       "joints.joint@ = { stiffness = 3, damping = 1, target = 0.2 }\ngravity = 'keep'\n"},
      {"whole-body law",
       {"whole"},
       {},
       {},
       "[[controller]]\ntype = 'whole_body'\nname = 'whole@'\nrate = 10\n"
       "[[controller.task]]\nquantity = 'posture'\nbandwidth = 1\n"},
      {"law in Python, tank",
       {"own"},
       {},
       {},
       "[[controller]]\ntype = 'python'\nname = 'own@'\npython = 'law.py:Law'\n"
       "joints = ['joint@']\nrate = 10\ndelay = 1\nresolution.torque = 1e-3\ntank = { level = 2, "
       "most = 100 }\n"
       "noise = { position = 1e-4, rate = 1e-3 }\n"},

      {"robot",
       {"robot", "other"},
       {},
       {},
       "[[robot]]\nname = 'other@'\nurdf = 'model.urdf'\nbase = 'free'\nposition = [0, 6, 0]\n"
       "angular_velocity = [0.1, 0, 0.2]\n[initial.joints.'other@.joint1']\nvelocity = 0.3\n"},
      {"outputs",
       {"output"},
       {},
       {},
       "[[output]]\nquantity = 'position'\nname = 'tip@'\nlink = 'lower'\nrelative_to = 'bus'\n"
       "[[output]]\nquantity = 'angular_velocity'\nname = 'turning@'\nlink = 'upper'\n"
       "[[output]]\nquantity = 'momentum'\nname = 'momentum@'\n"
       "[[output]]\nquantity = 'joint_torque'\nname = 'torque@'\njoint = 'joint2'\n"
       "[[output]]\nquantity = 'formula'\nname = 'far@'\nformula = 'sqrt(tip@.x^2 + tip@.y^2)'\n"
       "[[stop]]\noutput = 'far@'\nabove = 50\n"},
      {"joint wrench",
       {"wrench"},
       {},
       {},
       "[[output]]\nquantity = 'joint_wrench'\nname = 'wrench@'\njoint = 'joint1'\n"},

      {"drive fixed",  // its spring by formula
       {"actuator"},
       {},
       {},
       "[[actuator]]\njoint = 'joint@'\nfamily = 'formula'\nenergy = 'k/2*phi^2 + phi^4'\n"
       "parameters = { k = 20 }\ntheta = { drive = 'fixed' }\n"},
      {"drive torque",
       {"actuator"},
       {},
       {},
       actuator("drive = 'torque', inertia = 0.1, command = { constant = 0.3 }, viscous = 0.1")},
      {"drive position",
       {"actuator"},
       {},
       {},
       actuator("drive = 'position', inertia = 0.1, command = { constant = 0.4 }, kp = 4, kd = 1")},
      {"drive rate",
       {"actuator"},
       {},
       {},
       actuator("drive = 'rate', command = { sine = { amplitude = 0.3, frequency = 0.5 } }")},
      {"drive servo",
       {"actuator"},
       {},
       {},
       actuator("drive = 'servo', servo = [60, 50, 12], command = { constant = 0.4 }")},

      {"panel",
       {"panel"},
       {},
       {},
       "[[panel]]\nname = 'panel'\nlink = 'bus'\nat = [0, 0.4, 0]\nalong = [0, 1, 0]\n"
       "hinge_axis = [1, 0, 0]\nlength = 1\nmass = 1\nbending_stiffness = 1\nsegments = 2\n"},
      {"second body", {"body", "target"}, {}, {}, near_by},
      {"capture",
       {"event", "capture"},
       {},
       {},
       near_by + event("capture", "at = 0.@\nbody = 'target@'\nlink = 'lower'\nreach = 10")},
      {"release",
       {"event", "release"},
       {},
       {},
       event("release", "at = 0.@\nbody = 'tool@'"),
       link("tool@", "0.5", round, "-0.1") + joint("grip@", "lower", "tool@", "0 0 -0.6", "0 1 0")},
      {"capture by a link",
       {"event", "capture"},
       {},
       {},
       "[[robot]]\nname = 'prey@'\nurdf = 'model.urdf'\nbase = 'free'\nposition = [0, -6, 0]\n"
       "angular_velocity = [0.1, 0, 0.2]\n[initial.joints.'prey@.joint1']\nvelocity = 0.3\n" +
           event("capture", "at = 0.@\nbody = 'prey@.lower'\nlink = 'lower'\nreach = 10") +
           event("release", "at = 0.5\nbody = 'prey@.lower'")},
      {"lock and unlock",
       {"event", "lock"},
       {},
       {},
       event("lock", "at = 0.@\njoint = 'joint@'") + event("unlock", "at = 0.4\njoint = 'joint@'")},
      {"engage and disengage",
       {"event", "engage", "latch"},
       {},
       {},
       near_by + latch + "link = 'lower'\nbody = 'target@'\n" +
           event("engage", "at = 0.@\nlatch = 'latch@'\nreach = 10") +
           event("disengage", "at = 0.5\nlatch = 'latch@'")},
      {"coupling",
       {"gear"},
       {},
       {{"integrator.method", "'spark16'"},
        {"initial.joints.joint1", "{ position = 0.3, velocity = 1.8 }"}},
       "[[coupling]]\nname = 'gear@'\nfactors = { joint1 = 1, joint2 = -2 }\noffset = -0.3\n"},
      {"close and open",
       {"clutch"},
       {},
       {{"integrator.method", "'spark16'"}},
       "[[coupling]]\nname = 'clutch@'\nfactors = { joint1 = 1, joint2 = -1 }\n" +
           event("close", "at = 0.@\nloop = 'clutch@'") +
           event("open", "at = 0.5\nloop = 'clutch@'")},
      {"rolling",
       {"spin", "pgauss16"},
       method("pgauss16"),
       {},
       "[[rolling]]\nname = 'spin@'\ntype = 'no_spin'\nwheel = { link = 'lower', axis = [1, -1, 0] "
       "}\nground = { link = 'bus' }\n"},
      {"motion",
       {"turn", "motion"},
       {},
       {{"integrator.method", "'spark16'"}},
       "[[motion]]\nname = 'turn@'\njoint = 'joint2'\nsteady = { from = 0.3, rate = 0.9 }\n"},
      {"lock above", {"event", "lock"}, {}, {}, event("lock", "joint = 'joint@'\nabove = 0.32")},
      {"capture within reach",
       {"event", "capture"},
       {},
       {},
       coming + event("capture",
                      "when = 'within_reach'\nbody = 'target@'\nlink = 'upper'\n"
                      "on_link = [0.6, 0, 0.5]\nreach = 0.8")},

      {"monitor warn",
       {"monitor", "action"},
       {{"monitor.action", "'warn'"}},
       {{"monitor.limit", "1e-6"}}},
      {"monitor stop",
       {"monitor", "action"},
       {{"monitor.action", "'stop'"}},
       {{"monitor.limit", "1e-3"}}},
      {"monitor repeat",
       {"monitor", "action"},
       {{"monitor.action", "'repeat'"}},
       {{"monitor.step_limit", "1e-6"}}},
      {"monitor project", {"monitor"}, {{"monitor.project", "true"}}},

      {"steps time_transformed",
       {"step_control"},
       {{"integrator.step_control", "'time_transformed'"}}},
      {"steps reversible", {"step_control"}, {{"integrator.step_control", "'reversible'"}}},
      {"shorter last step", {"duration", "last step"}, {{"run.duration", "0.61"}}},
      {"extrema", {"extrema"}, {{"run.extrema", "'all'"}}, {{"run.record_every", "0.1"}}},

      {"gauss16, stages in lanes", {"gauss16"}, method("gauss16")},
      {"composition", {"kahan_li6"}, method("kahan_li6"), modest("0.01", "1e-8")},
      {"stormer_verlet", {"stormer_verlet"}, method("stormer_verlet"), modest("0.002", "1e-4")},
      {"tao4", {"tao4"}, method("tao4"), modest("0.002", "1e-6")},
      {"discrete gradient",
       {"gonzalez"},
       method("gonzalez"),
       {{"integrator.step", "0.005"},
        {"verify.energy", "1e-5"},
        {"verify.linear_momentum", "1e-8"}}},
      {"time stepping",
       {"moreau", "slab"},
       method("moreau"),
       modest("0.002", "1e-8"),
       "[[contact]]\nname = 'slab@'\nlinks = ['lower']\nagainst = ['bus']\n"
       "shape = { kind = 'sphere', radius = 0.2, at = [0, 0, -0.5] }\n"
       "against_shape = { kind = 'sphere', radius = 0.3, at = [0.5, 0.3, -1.2] }\n"
       "law = 'rigid'\nrestitution = 0.7\nfriction = 0.3\n"},
      {"radau15", {"radau15"}, method("radau15"), modest("0.002", "1e-8")},
      {"rk4", {"rk4"}, method("rk4"), modest("0.002", "1e-6")},
      {"reference solver, cvode_adams",
       {"cvode_adams"},
       method("cvode_adams"),
       modest("0.002", "1e-6")},
      {"splitting strang", {"strang"}, {{"orbit.splitting", "'strang'"}}, in_orbit},
      {"splitting aba864", {"aba864"}, {{"orbit.splitting", "'aba864'"}}, in_orbit},
      {"auto", {"auto"}, method("auto"), {{"integrator.target_energy_error", "1e-9"}}},

      {"resume", {"resume", "continued"}, {{"command", "run"}}, {}, {}, {}, Mode::resume},
      {"ensemble", {"ensemble"}, {{"command", "ensemble"}}, {}, {}, {}, Mode::ensemble},
      {"compare", {"compare"}, {{"command", "compare"}}, {}, {}, {}, Mode::compare},
      {"Python", {"Python"}, {{"command", "Python"}}, {}, {}, {}, Mode::python},
      {"report", {"report"}, {}, {}, {}, {}, Mode::report},
  };
}

std::string with(std::string text, const std::string& digit) {
  for (size_t at = 0; (at = text.find('@', at)) != text.npos;) text.replace(at, 1, digit);
  return text;
}

}  // namespace

const std::vector<Feature>& features() {
  static const std::vector<Feature> list = all();
  return list;
}

const Feature& feature(const std::string& name) {
  for (const Feature& f : features())
    if (f.name == name) return f;
  throw std::out_of_range("no feature is called " + name);
}

bool alternatives(const Feature& a, const Feature& b) {
  for (const auto& [key, value] : a.sets)
    for (const auto& [other, its] : b.sets)
      if (key == other && value != its) return true;
  return false;
}

SceneTexts scene_of(const Feature& a, const Feature& b, const Settings& more) {
  std::map<std::string, std::string> values{
      {"model.urdf", "'model.urdf'"},
      {"model.base", "'free'"},
      {"initial.joints.joint1", "{ position = 0.3, velocity = 0.8 }"},
      {"initial.joints.joint2", "{ position = 0.3, velocity = 0.9 }"},
      {"integrator.method", "'gauss8'"},
      {"integrator.step", "0.02"},
      {"run.duration", "0.6"}};
  for (const Settings* s : {&b.needs, &a.needs, &b.sets, &a.sets, &more})
    for (const auto& [key, value] : *s)
      if (key != "command") values[key] = value;
  if (values["model.base"] == "'free'")
    values["initial.base"] = "{ angular_velocity = [0.1, -0.2, 0.3] }";
  if (values.count("orbit.altitude") && values.erase("environment.magnetic_field")) {
    values["planet.rotation_rate"] = "7.29e-5";
    values["planet.magnetic"] = "{ equator = 3e-5 }";  // the field of a torquer is the planet's
  }
  SceneTexts t;
  std::string table;
  for (const auto& [key, value] : values) {
    const size_t dot = key.rfind('.');
    if (key.substr(0, dot) != table) t.scene += "[" + (table = key.substr(0, dot)) + "]\n";
    t.scene += key.substr(dot + 1) + " = " + value + "\n";
  }
  t.scene += with(a.tables, "1") + with(b.tables, "2");
  t.urdf = "<robot name='arm'>\n" + arm() + with(a.links, "1") + with(b.links, "2") + "</robot>\n";
  return t;
}

}  // namespace porthos::test::combinations
