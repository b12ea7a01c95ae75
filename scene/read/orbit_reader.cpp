#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "scene/read/orbit.h"
#include "scene/read/start_from.h"
#include "scene/read/toml_table-inl.h"
#include "space/ephemeris.h"
#include "space/split_scheme.h"

namespace porthos::scene {
namespace {

/// harmonics = "earth", "none" or [J2, J3, J4, J5, J6].
void harmonics(const Table& t, space::Planet& p) {
  if (!t.has("harmonics")) return;
  if (t.is_array("harmonics")) {
    p.J = t.numbers<5>("harmonics", " J2 to J6, or \"earth\" or \"none\"");
    const double earth = space::Planet().mu;
    if (p.J[0] < 0 && std::fabs(p.mu - earth) < 0.01 * earth)
      t.fail("harmonics",
             fmt::format("begins with J2 = {:g}, an Earth longer than wide, expected 1.0826e-3: of "
                         "normalised coefficients J2 is -sqrt(5) C20, here {:.6g}",
                         p.J[0], -std::sqrt(5.0) * p.J[0]));
    return;
  }
  const std::string word = t.text("harmonics", "\"earth\", \"none\" or five numbers J2 to J6");
  if (word == "earth")
    p.J = space::earth_zonals();
  else if (word != "none")
    t.fail("harmonics",
           fmt::format("is \"{}\", expected \"earth\", \"none\" or five numbers J2 to J6", word));
}

void planet(const Table& t, space::Planet& p) {
  p.mu = t.positive_or("mu", p.mu);
  p.radius = t.positive_or("radius", p.radius);
  if (const double g = p.mu / (p.radius * p.radius); (g < 1e-6 && p.mu > 10) || g > 1e5)
    t.fail(t.has("mu") ? "mu" : "radius",
           fmt::format("gives a gravity of {:.2g} m/s^2 at the radius of {:g} m, expected mu in "
                       "m^3/s^2 and the radius in m: are they in km?",
                       g, p.radius));
  p.axis = t.direction("axis");
  harmonics(t, p);
  if (t.has("magnetic")) {
    const Table d = t.table("magnetic");
    p.magnetic =
        space::MagneticDipole{d.positive("equator"), d.number("tilt"), d.number("longitude")};
  }
  if (t.has("rotation_rate")) p.rotation_rate = t.number("rotation_rate");
}

/// An angle [rad] from `least` to a full turn or half of one; degrees are refused.
double orbit_angle(const Table& t, const char* key, double least, double most) {
  const double a = t.number(key);
  if (a < least || a > most)
    t.fail(key, fmt::format("is {} rad, expected {:.6g} to {:.6g}; {} degrees are {:.6g} rad", a,
                            least, most, a, a * std::numbers::pi / 180));
  return a;
}

/// Start from position and velocity, or from elements; a circle if no shape is given.
space::PointState<double> start_of(const Table& t, const space::Planet& p) {
  const bool vectors = t.has("position") || t.has("velocity");
  for (const char* key : {"altitude", "semi_major_axis", "eccentricity", "inclination", "node",
                          "argument", "true_anomaly"})
    if (vectors && t.has(key))
      t.fail(key, "is given with position and velocity, expected one of both");
  if (vectors) {
    t.require("position", "3 numbers of metres");
    t.require("velocity", "3 numbers of m/s");
    return {t.vector("position"), t.vector("velocity")};
  }
  if (t.has("altitude") == t.has("semi_major_axis"))
    refuse(t.where(), fmt::format("[orbit] has {} of the keys altitude and semi_major_axis, "
                                  "expected one, or position and velocity",
                                  t.has("altitude") ? "both" : "none"));
  const double e = t.not_negative("eccentricity");
  if (e >= 1)
    t.fail("eccentricity", fmt::format("is {}, expected less than 1: a hyperbola is given by its "
                                       "position and velocity",
                                       e));
  const double a =
      t.has("altitude") ? p.radius + t.number("altitude") : t.positive("semi_major_axis");
  if (t.has("altitude") && e > 0)
    t.fail("altitude", "is given with an eccentricity, expected semi_major_axis");
  if (!(a > 0)) t.fail("altitude", "is below the centre of the planet");
  if (const double h = a - p.radius; t.has("altitude") && h >= 0 && h < 1e-3 * p.radius)
    t.fail("altitude", fmt::format("is {:g} m above a planet of {:g} m, expected more than a "
                                   "thousandth of its radius, in metres",
                                   h, p.radius));
  constexpr double turn = 2 * std::numbers::pi;
  return space::from_elements(p.mu, a, e, orbit_angle(t, "inclination", 0, std::numbers::pi),
                              orbit_angle(t, "node", -turn, turn),
                              orbit_angle(t, "argument", -turn, turn),
                              orbit_angle(t, "true_anomaly", -turn, turn));
}

/// Sun and Moon by date, or on mean ellipses.
void third_bodies(const Table& t, space::Environment& env) {
  if (t.has("epoch")) {
    for (const char* key : {"sun_longitude", "moon_longitude"})
      if (t.has(key)) t.fail(key, "is given with an epoch, expected one of both");
    const std::string date = t.text("epoch", "a date and time of UTC as \"2026-01-01T00:00:00\"");
    try {
      env.greenwich = space::greenwich_angle(space::date_of(date));
    } catch (const InvalidArgument& e) {
      refuse(t.at("epoch"), e.what());
    }
    for (const auto& [key, which] :
         {std::pair{"sun", space::Luminary::sun}, {"moon", space::Luminary::moon}})
      if (t.boolean(key)) env.third_bodies.push_back(space::dated_body(which, date));
    return;
  }
  for (const char* key : {"sun", "moon"})
    if (t.has(key)) t.fail(key, "is given without an epoch, expected both or neither");
  if (t.has("sun_longitude"))
    env.third_bodies.push_back(space::mean_sun(t.number("sun_longitude")));
  if (t.has("moon_longitude"))
    env.third_bodies.push_back(space::mean_moon(t.number("moon_longitude")));
}

void plates(const Table& t, space::Environment& env) {
  t.each_of("plates", "link", [&](const std::string& link, const Table& p) {
    space::Plate plate;
    plate.link = link;
    plate.where = p.where();
    plate.area = p.positive("area");
    p.require("normal", "3 numbers, the outward normal");
    plate.normal = p.vector("normal");
    plate.place = p.vector("place");
    plate.drag = p.not_negative("drag_coefficient");
    plate.specular = p.not_negative("specular");
    plate.diffuse = p.not_negative("diffuse");
    env.plates.push_back(std::move(plate));
  });
}

void forces(const Table& t, space::Environment& env) {
  third_bodies(t, env);
  plates(t, env);
  const auto area = [&](const Table& of) {  // of a sphere besides the plates
    return !env.plates.empty() && !of.has("area_coefficient") ? 0.0
                                                              : of.positive("area_coefficient");
  };
  if (t.has("drag")) {
    const Table d = t.table("drag");
    const double altitude = d.positive("altitude"), height = d.positive("scale_height");
    if (altitude < 1e4)
      d.fail("altitude",
             fmt::format("is {:g} m, expected 10 000 m or more: are they km?", altitude));
    if (!(height >= 1e3 && height <= 1e6))
      d.fail("scale_height", fmt::format("is {:g} m, expected 1000 to 1 000 000 m{}", height,
                                         height < 1e3 ? ": are they km?" : ""));
    env.atmosphere = space::Atmosphere{d.positive("density"), altitude, height, area(d)};
  }
  if (t.has("sunlight")) {
    const Table s = t.table("sunlight");
    space::SolarPressure light;
    light.area_coefficient = area(s);
    light.at_1_au = s.positive("pressure");
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
  OrbitScene o;
  if (top.has("planet")) planet(top.table("planet"), o.environment.planet);
  const Table t = top.table("orbit");
  o.where = t.where();
  o.start = start_of(t, o.environment.planet);
  forces(t, o.environment);
  for (const char* key : {"sun_longitude", "moon_longitude"})
    if (t.has(key)) o.longitudes[key] = t.number(key);
  if (const auto& dipole = o.environment.planet.magnetic)
    o.longitudes["magnetic.longitude"] = dipole->longitude;
  if (t.has("epoch")) o.epoch = t.text("epoch", "a date");
  if (t.has("splitting")) o.splitting = t.text("splitting", "the name of a splitting");
  try {
    space::split_scheme(o.splitting);
    o.environment.validate();
    space::check_orbit(o.environment.planet, o.start, t.boolean("bound"));
  } catch (const InvalidArgument& e) {
    refuse(o.where, e.what());
  }
  return o;
}

void go_on_in_orbit(const StartFrom& from, OrbitScene& o) {
  if (from.epoch && *from.epoch != o.epoch) {
    const auto named = [](const std::string& epoch) {
      return epoch.empty() ? std::string("no epoch") : "epoch = \"" + epoch + "\"";
    };
    refuse(o.where,
           fmt::format("[orbit] has {}, and the run in {} goes on from {}: expected that one, as "
                       "the time since then is added",
                       named(o.epoch), from.folder, named(*from.epoch)));
  }
  for (const auto& [key, own] : o.longitudes)
    if (const auto first = from.longitudes.find(key);
        first != from.longitudes.end() && std::fabs(own - first->second) > 1e-12)
      refuse(
          o.where,
          fmt::format("{} is {:.9g} rad, and the run in {} goes on from {:.9g} rad: expected that "
                      "one, as the time since then is added",
                      key, own, from.folder, first->second));
  o.environment = space::counted_from(std::move(o.environment), from.elapsed);
}

}  // namespace porthos::scene
