#include <fmt/format.h>

#include "scene/read/orbit.h"
#include "scene/read/toml_table-inl.h"
#include "space/ephemeris.h"
#include "space/split_scheme.h"

namespace porthos::scene {
namespace {

const Names planet_keys{"mu", "radius", "axis", "harmonics", "rotation_rate", "magnetic"};
const Names orbit_keys{"altitude",       "semi_major_axis", "eccentricity", "inclination",
                       "node",           "argument",        "true_anomaly", "position",
                       "velocity",       "bound",           "splitting",    "sun_longitude",
                       "moon_longitude", "epoch",           "sun",          "moon",
                       "drag",           "sunlight",        "plates"};

double positive(const Table& t, const char* key, const char* unit, double otherwise) {
  const double x = t.number_or(key, unit, otherwise);
  if (!(x > 0)) t.fail(key, fmt::format("is {}, expected a positive number{}", x, unit));
  return x;
}
double required_positive(const Table& t, const char* key, const char* unit) {
  t.require(key, fmt::format("a number{}", unit));
  return positive(t, key, unit, 0);
}

/// harmonics = "earth", "none" or [J2, J3, J4, J5, J6].
void harmonics(const Table& t, space::Planet& p) {
  if (!t.has("harmonics")) return;
  try {
    p.J = t.numbers<5>("harmonics", " J2 to J6, or \"earth\" or \"none\"");
  } catch (const InvalidArgument&) {
    const std::string word = t.text("harmonics", "\"earth\", \"none\" or five numbers J2 to J6");
    if (word == "earth")
      p.J = space::earth_zonals();
    else if (word != "none")
      t.fail("harmonics",
             fmt::format("is \"{}\", expected \"earth\", \"none\" or five numbers J2 to J6", word));
  }
}

void planet(const Table& t, space::Planet& p) {
  p.mu = positive(t, "mu", " of m^3/s^2", p.mu);
  p.radius = positive(t, "radius", " of metres", p.radius);
  if (t.has("axis")) {
    const space::Vec3d k = t.vector_or_zero("axis", "");
    const double length = mechanics::norm(k);
    if (!(length > 0)) t.fail("axis", "has length 0, expected a direction");
    p.axis = (1 / length) * k;
  }
  harmonics(t, p);
  if (t.has("magnetic")) {
    const Table d = t.table("magnetic", {"equator", "tilt", "longitude"});
    p.magnetic = space::MagneticDipole{required_positive(d, "equator", " of tesla"),
                                       d.number_or("tilt", " of rad", 0),
                                       d.number_or("longitude", " of rad", 0)};
  }
  if (t.has("rotation_rate")) p.rotation_rate = t.number("rotation_rate", " of rad/s");
}

/// From position and velocity, or from elements; a circle where nothing is said of its shape.
space::PointState<double> start_of(const Table& t, const space::Planet& p) {
  const bool vectors = t.has("position") || t.has("velocity");
  for (const char* key : {"altitude", "semi_major_axis", "eccentricity", "inclination", "node",
                          "argument", "true_anomaly"})
    if (vectors && t.has(key))
      t.fail(key, "is given with position and velocity, expected one of both");
  if (vectors) {
    t.require("position", "3 numbers of metres");
    t.require("velocity", "3 numbers of m/s");
    return {t.vector_or_zero("position", " of metres"), t.vector_or_zero("velocity", " of m/s")};
  }
  if (t.has("altitude") == t.has("semi_major_axis"))
    refuse(t.where(), fmt::format("[orbit] has {} of the keys altitude and semi_major_axis, "
                                  "expected one, or position and velocity",
                                  t.has("altitude") ? "both" : "none"));
  const double e = t.not_negative_or("eccentricity", "", 0);
  if (e >= 1)
    t.fail("eccentricity", fmt::format("is {}, expected less than 1: a hyperbola is given by its "
                                       "position and velocity",
                                       e));
  const double a = t.has("altitude") ? p.radius + t.number("altitude", " of metres")
                                     : positive(t, "semi_major_axis", " of metres", 1);
  if (t.has("altitude") && e > 0)
    t.fail("altitude", "is given with an eccentricity, expected semi_major_axis");
  if (!(a > 0)) t.fail("altitude", "is below the centre of the planet");
  const auto angle = [&](const char* key) { return t.number_or(key, " of rad", 0); };
  return space::from_elements(p.mu, a, e, angle("inclination"), angle("node"), angle("argument"),
                              angle("true_anomaly"));
}

/// Sun and Moon by date, or on mean ellipses.
void third_bodies(const Table& t, space::Environment& env) {
  if (t.has("epoch")) {
    for (const char* key : {"sun_longitude", "moon_longitude"})
      if (t.has(key)) t.fail(key, "is given with an epoch, expected one of both");
    const std::string date = t.text("epoch", "a date and time of UTC as \"2026-01-01T00:00:00\"");
    for (const auto& [key, which] :
         {std::pair{"sun", space::Luminary::sun}, {"moon", space::Luminary::moon}})
      try {
        if (!t.has(key) || t.boolean(key))
          env.third_bodies.push_back(space::dated_body(which, date));
      } catch (const InvalidArgument& e) {
        refuse(t.at("epoch"), e.what());
      }
    return;
  }
  for (const char* key : {"sun", "moon"})
    if (t.has(key)) t.fail(key, "is given without an epoch, expected both or neither");
  if (t.has("sun_longitude"))
    env.third_bodies.push_back(space::mean_sun(t.number("sun_longitude", " of rad")));
  if (t.has("moon_longitude"))
    env.third_bodies.push_back(space::mean_moon(t.number("moon_longitude", " of rad")));
}

void plates(const Table& t, space::Environment& env) {
  const auto known = [](const std::string&, const std::string&) -> Names {
    return {"link", "area", "normal", "place", "drag_coefficient", "specular", "diffuse"};
  };
  t.each_of("plates", "link", known, [&](const std::string& link, const Table& p) {
    space::Plate plate;
    plate.link = link;
    plate.where = p.where();
    plate.area = required_positive(p, "area", " of m^2");
    p.require("normal", "3 numbers, the outward normal");
    plate.normal = p.vector_or_zero("normal", "");
    plate.place = p.vector_or_zero("place", " of metres");
    plate.drag = p.not_negative_or("drag_coefficient", "", 0);
    plate.specular = p.not_negative_or("specular", "", 0);
    plate.diffuse = p.not_negative_or("diffuse", "", 0);
    env.plates.push_back(std::move(plate));
  });
}

void forces(const Table& t, space::Environment& env) {
  third_bodies(t, env);
  plates(t, env);
  const auto area = [&](const Table& of) {  // of a sphere besides the plates
    return !env.plates.empty() && !of.has("area_coefficient")
               ? 0.0
               : required_positive(of, "area_coefficient", " of m^2");
  };
  if (t.has("drag")) {
    const Table d = t.table("drag", {"density", "altitude", "scale_height", "area_coefficient"});
    env.atmosphere = space::Atmosphere{required_positive(d, "density", " of kg/m^3"),
                                       required_positive(d, "altitude", " of metres"),
                                       required_positive(d, "scale_height", " of metres"), area(d)};
  }
  if (t.has("sunlight")) {
    const Table s = t.table("sunlight", {"area_coefficient", "pressure"});
    space::SolarPressure light;
    light.area_coefficient = area(s);
    light.at_1_au = positive(s, "pressure", " of N/m^2", light.at_1_au);
    env.solar_pressure = light;
  }
}

}  // namespace

std::optional<OrbitScene> read_orbit(const Table& top) {
  if (!top.has("orbit")) {
    if (top.has("planet"))
      top.fail("planet", "is given without an [orbit], expected both or neither");
    return {};
  }
  const auto section = [&](const char* key, const Names& known) { return top.table(key, known); };
  OrbitScene o;
  if (top.has("planet")) planet(section("planet", planet_keys), o.environment.planet);
  const Table t = section("orbit", orbit_keys);
  o.where = t.where();
  o.start = start_of(t, o.environment.planet);
  forces(t, o.environment);
  if (t.has("splitting")) o.splitting = t.text("splitting", "the name of a splitting");
  try {
    space::split_scheme(o.splitting);
    o.environment.validate();
    space::check_orbit(o.environment.planet, o.start, !t.has("bound") || t.boolean("bound"));
  } catch (const InvalidArgument& e) {
    refuse(o.where, e.what());
  }
  return o;
}

}  // namespace porthos::scene
