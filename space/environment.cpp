#include "space/environment.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace porthos::space {
namespace {

constexpr double tau = 6.283185307179586476925286766559;
constexpr double obliquity = 0.40909280422232897;  // 23.4392911 degrees, J2000

double length(const Vec3d& v) { return mechanics::norm(v); }

/// Rotates from the ecliptic to the equator.
PointState<double> tilted(const PointState<double>& s) {
  const double c = std::cos(obliquity), n = std::sin(obliquity);
  const auto turn = [&](const Vec3d& a) {
    return Vec3d{a.x, c * a.y - n * a.z, n * a.y + c * a.z};
  };
  return {turn(s.r), turn(s.v)};
}

/// The true anomaly from the mean one by Kepler's equation; Newton's iteration, for small
/// eccentricities.
double true_anomaly(double mean, double e) {
  double E = mean;
  for (int i = 0; i < 10; ++i) E -= (E - e * std::sin(E) - mean) / (1 - e * std::cos(E));
  return 2 * std::atan2(std::sqrt(1 + e) * std::sin(E / 2), std::sqrt(1 - e) * std::cos(E / 2));
}

void positive(double x, const char* what, const char* unit) {
  if (!(x > 0 && std::isfinite(x)))
    throw InvalidArgument(fmt::format("{} is {} {}, expected a positive number", what, x, unit));
}

}  // namespace

Zonals earth_zonals() {
  return {1.082626683553e-3, -2.532656485e-6, -1.619621591e-6, -2.272960829e-7, 5.406812391e-7};
}

PointState<double> from_elements(double mu, double a, double e, double i, double node,
                                 double argument, double anomaly) {
  const double p = a * (1 - e * e), r = p / (1 + e * std::cos(anomaly)), w = std::sqrt(mu / p);
  const double u = argument + anomaly;
  const Vec3d N{std::cos(node), std::sin(node), 0};
  const Vec3d M{-std::sin(node) * std::cos(i), std::cos(node) * std::cos(i), std::sin(i)};
  const auto at = [&](double angle) { return std::cos(angle) * N + std::sin(angle) * M; };
  const auto across = [&](double angle) { return -std::sin(angle) * N + std::cos(angle) * M; };
  return {r * at(u), w * (across(u) + e * across(argument))};
}

ThirdBody mean_sun(double longitude) {
  const double mu = 1.32712440018e20, total = mu + 3.986004415e14, e = 0.0167086;
  constexpr double perigee = 4.93819;  // 282.9373 degrees
  return {"sun", mu,
          tilted(from_elements(total, 1.49598023e11, e, 0, 0, perigee,
                               true_anomaly(longitude - perigee, e))),
          total};
}

ThirdBody mean_moon(double longitude, double perigee, double node) {
  const double mu = 4.9028e12, total = mu + 3.986004415e14, e = 0.0549;
  return {"moon", mu,
          tilted(from_elements(total, 3.844e8, e, 0.0898, node, perigee - node,
                               true_anomaly(longitude - perigee, e))),
          total};
}

namespace {
class LaterEphemeris final : public Ephemeris {
 public:
  LaterEphemeris(std::shared_ptr<const Ephemeris> of, double by) : of_(std::move(of)), by_(by) {}
  Vec3d position(double t) const override { return of_->position(by_ + t); }

 private:
  std::shared_ptr<const Ephemeris> of_;
  double by_;
};
}  // namespace

Environment counted_from(Environment e, double elapsed) {
  for (ThirdBody& body : e.third_bodies) {
    body.start = kepler_flow(body.total_mu, body.start, elapsed);
    if (body.ephemeris)
      body.ephemeris = std::make_shared<LaterEphemeris>(std::move(body.ephemeris), elapsed);
  }
  constexpr double earth_rate = 7.2921159e-5;  // [rad/s], as the playback turns a planet without
  const double turned =
      std::remainder(e.planet.rotation_rate.value_or(earth_rate) * elapsed, 2 * std::numbers::pi);
  e.greenwich += turned;
  if (e.planet.magnetic && e.planet.rotation_rate) e.planet.magnetic->longitude += turned;
  return e;
}

std::vector<std::string> forces_of(const Environment& e) {
  std::vector<std::string> all;
  for (const ThirdBody& body : e.third_bodies)
    all.push_back(body.name == "sun" ? "the Sun" : body.name == "moon" ? "the Moon" : body.name);
  for (size_t n = 0; n < e.planet.J.size(); ++n)
    if (e.planet.J[n] != 0) all.push_back("J" + std::to_string(n + 2));
  if (e.planet.magnetic) all.push_back("the dipole");
  const auto any = [&](auto of) { return std::ranges::any_of(e.plates, of); };
  if (e.atmosphere || any([](const Plate& p) { return p.drag > 0; })) all.push_back("drag");
  if (e.solar_pressure) all.push_back("sunlight");
  return all;
}

void Environment::validate() const {
  positive(planet.mu, "the planet's mu", "m^3/s^2");
  positive(planet.radius, "the planet's radius", "m");
  if (!finite(planet.axis) || std::fabs(length(planet.axis) - 1) > 1e-9)
    throw InvalidArgument("the planet's axis has length " + std::to_string(length(planet.axis)) +
                          ", expected 1");
  for (const double J : planet.J)
    if (!(std::fabs(J) < 1))
      throw InvalidArgument(fmt::format("a zonal harmonic is {}, expected |J| < 1", J));
  if (planet.magnetic) {
    positive(planet.magnetic->equator, "the planet's magnetic field at its equator", "T");
    if (planet.magnetic->tilt != 0 && !planet.rotation_rate)
      throw InvalidArgument(
          "a tilted magnetic dipole turns with its planet, whose rotation is not given, expected "
          "rotation_rate (0 for one that stands still)");
  }
  bool sun = false;
  for (const auto& b : third_bodies) {
    positive(b.mu, "the mu of a third body", "m^3/s^2");
    positive(b.total_mu, "the total mu of a third body", "m^3/s^2");
    if (!finite(b.start.r) || !finite(b.start.v) || length(b.start.r) <= planet.radius)
      throw InvalidArgument(
          fmt::format("third body '{}' starts {} m from the planet's centre, expected more than "
                      "the planet's radius",
                      b.name, length(b.start.r)));
    sun = sun || b.name == "sun";
  }
  if (atmosphere) {
    positive(atmosphere->density, "the density of the atmosphere", "kg/m^3");
    positive(atmosphere->scale_height, "the scale height of the atmosphere", "m");
    if (plates.empty() || atmosphere->area_coefficient != 0)
      positive(atmosphere->area_coefficient, "the drag area C_D A", "m^2");
    if (!planet.rotation_rate)
      throw InvalidArgument(
          "an atmosphere turns with its planet, whose rotation is not given, expected "
          "rotation_rate (0 for one that stands still)");
  }
  if (solar_pressure) {
    if (plates.empty() || solar_pressure->area_coefficient != 0)
      positive(solar_pressure->area_coefficient, "the area C_R A in sunlight", "m^2");
    if (!sun)
      throw InvalidArgument(
          "sunlight is asked for without a sun, expected one: epoch or sun_longitude in [orbit], "
          "in C++ "
          "a third body named \"sun\"");
  }
  for (const Plate& p : plates) {
    const auto check = [&](bool holds, const std::string& what) {
      if (!holds)
        throw InvalidArgument(
            fmt::format("{}a plate of link '{}' has {}", in_file(p.where), p.link, what));
    };
    check(p.area > 0 && std::isfinite(p.area),
          fmt::format("area {} m^2, expected a positive number", p.area));
    check(finite(p.normal) && length(p.normal) > 0, "a normal of length 0, expected a direction");
    check(finite(p.place), "a place that is not finite, expected 3 numbers of metres");
    check(p.drag >= 0 && std::isfinite(p.drag),
          fmt::format("drag coefficient {}, expected 0 or more", p.drag));
    check(p.specular >= 0 && p.diffuse >= 0 && p.specular + p.diffuse <= 1,
          fmt::format("specular {} and diffuse {}, expected shares of 0 and more, together at "
                      "most 1",
                      p.specular, p.diffuse));
    check(atmosphere || solar_pressure, "nothing to feel, expected drag or sunlight");
  }
}

Elements elements_of(double mu, const PointState<double>& s) {
  const double r = length(s.r), v2 = dot(s.v, s.v);
  const Vec3d h = cross(s.r, s.v), k{0, 0, 1};
  const Vec3d e = (1 / mu) * (cross(s.v, h) - (mu / r) * s.r);
  const Vec3d n = cross(k, h);
  Elements o{};
  const double beta = 2 * mu / r - v2;
  o.semi_major_axis = mu / beta;
  o.eccentricity = length(e);
  o.inclination = std::atan2(std::hypot(h.x, h.y), h.z);
  o.node = length(n) > 0 ? std::atan2(n.y, n.x) : 0;
  const Vec3d N{std::cos(o.node), std::sin(o.node), 0}, M = (1 / length(h)) * cross(h, N);
  const double u = std::atan2(dot(s.r, M), dot(s.r, N));
  o.argument = o.eccentricity > 1e-12 ? std::atan2(dot(e, M), dot(e, N)) : 0;
  o.true_anomaly = u - o.argument;
  o.period = beta > 0 ? tau * mu / (beta * std::sqrt(beta)) : HUGE_VAL;
  o.pericentre = dot(h, h) / (mu * (1 + o.eccentricity));
  return o;
}

void check_orbit(const Planet& planet, const PointState<double>& start, bool bound) {
  if (!finite(start.r) || !finite(start.v))
    throw InvalidArgument("the orbit's start is not finite, expected numbers of m and m/s");
  const double r = length(start.r);
  if (r < planet.radius)
    throw InvalidArgument(fmt::format(
        "the orbit starts {:.6g} km below the surface of the planet, whose radius is {:.6g} km",
        (planet.radius - r) / 1e3, planet.radius / 1e3));
  const Elements o = elements_of(planet.mu, start);
  if (bound && !std::isfinite(o.period))
    throw InvalidArgument(fmt::format(
        "the orbit is hyperbolic (eccentricity {:.6g}), expected a bound one", o.eccentricity));
  if (bound && o.pericentre < planet.radius)
    throw InvalidArgument(
        fmt::format("the orbit's pericentre is {:.6g} km below the surface of the planet, whose "
                    "radius is {:.6g} km",
                    (planet.radius - o.pericentre) / 1e3, planet.radius / 1e3));
}

}  // namespace porthos::space
