#include "mechanics/joint_list.h"
#include "scene/read/schema_keys-inl.h"
#include "vsa/catalogue.h"

namespace porthos::scene {
namespace {

/// waits: the event may wait for a condition instead of a time.
SchemaTable event(const char* type, const char* what, bool waits, const keys::Keys& own) {
  using namespace keys;
  return {fmt::format("event.{}", type), fmt::format("[[event]] type = \"{}\"", type), what,
          joined({word("type", {type}, required, "what happens"),
                  number("at", "s", waits ? "required, unless it waits" : required,
                         "when, a whole number of steps")},
                 own)};
}
/// Keys of events that may wait until their limits hold.
keys::Keys reaching(const std::string& reach = keys::required) {
  using namespace keys;
  return {
      word("when", {"within_reach"}, "it does not wait", "instead of at: until all limits hold"),
      number("after", "s", "0", "it waits from then on"),
      number("reach", "m", reach, "largest distance of the points"),
      number("speed", "m/s", "any", "largest speed of the points"),
      number("rate", "rad/s", "any", "largest relative rate")};
}

keys::Keys drive() {
  using namespace keys;
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

std::vector<std::string> family_names() {
  std::vector<std::string> names;
  for (const auto& f : vsa::families()) names.push_back(f.name);
  return names;
}

std::vector<std::string> loop_types() {
  std::vector<std::string> types;
  for (const auto& name : mechanics::joint_type_names())
    if (name != "free") types.push_back(name);
  types.emplace_back("rod");
  return types;
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a table
std::vector<SchemaTable> part_tables() {
  using namespace keys;
  std::vector<SchemaTable> all{
      {"body", "[[body]]", "A body besides the model, free in the world.",
       joined(joined({text("name", required, "its name")}, mass(required)), motion(true))},
      {"loop",
       "[[loop]]",
       "A joint that closes a loop of the tree, or a rod between two links.",
       {text("name", required, "in the ledger and in messages"),
        word("type", loop_types(), required, "what moves freely; rod: a distance is kept"),
        table("a", "loop.frame", required, "where it sits on one link"),
        table("b", "loop.frame", required, "where it sits on the other"),
        number("pitch", "m/rad", "required by helical", "advance per radian"),
        number("length", "m", "required by rod", "between the two positions")}},
      {"loop.frame",
       "[loop.a], [loop.b]",
       "A frame on a link. The joint is closed where a and b coincide, except for its freedoms.",
       {text("link", required, "of the model, or \"world\""),
        numbers("position", 3, "m", "[0, 0, 0]", "in the link's frame"),
        numbers("axis", 3, "1", "[0, 0, 1]",
                "its z axis in the link's frame: the joint's axis (universal: x of b)"),
        numbers("attitude_wxyz", 4, "1", "by axis",
                "instead: the whole frame; fixed and prismatic need equal ones")}},
      {"coupling",
       "[[coupling]]",
       "The sum of factor times coordinate keeps a value: gears, belts, mimic joints, racks.",
       {text("name", required, "in the ledger and in messages"),
        {"factors",
         KeyKind::named,
         "1",
         required,
         "by coordinate, as porthos info names it; angles count their turns",
         {},
         1},
        number("offset", "rad (m)", "0", "the value")}},
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
      event("disengage", "It lets go.", false,
            {text("latch", required, "name of a soft latch or a line spring")}),
      event("close", "A loop or coupling closes as the mechanism stands.", true,
            joined({text("loop", required, "of a [[loop]] or [[coupling]], open until then")},
                   reaching("required for a joint"))),
      event("open", "A loop or coupling opens.", false,
            {text("loop", required, "of a [[loop]] or [[coupling]]")}),
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

}  // namespace porthos::scene
