#include "space/orbit.h"

#include <algorithm>
#include <cmath>

#include "phs/system/state.h"
#include "space/plates.h"
#include "space/split_scheme.h"

namespace porthos::space {
namespace {

constexpr double astronomical_unit = 149597870700.0;  // m, IAU 2012

}  // namespace

OrbitPoint load_point(std::span<const double> x, std::span<const double> lo) {
  const auto at = [&](size_t i) { return OrbitReal(x[i]) + OrbitReal(lo[i]); };
  return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}};
}

void store_point(const OrbitPoint& p, std::span<double> x, std::span<double> lo) {
  const OrbitReal values[] = {p.r.x, p.r.y, p.r.z, p.v.x, p.v.y, p.v.z};
  for (size_t i = 0; i < 6; ++i) {
    x[i] = double(values[i]);
    lo[i] = double(values[i] - x[i]);
  }
}

const char* to_string(OrbitSource s) {
  switch (s) {
    case OrbitSource::zonal:
      return "zonal_harmonics";
    case OrbitSource::gradient:
      return "gravity_gradient";
    case OrbitSource::third_body:
      return "third_bodies";
    case OrbitSource::drag:
      return "drag";
    case OrbitSource::sunlight:
      return "sunlight";
    case OrbitSource::thrust:
      return "thrust";
    case OrbitSource::count:
      break;
  }
  return "";
}

OrbitMotion::OrbitMotion(Environment environment, double mass)
    : environment_(std::move(environment)), mass_(mass), mu_(environment_.planet.mu) {
  environment_.validate();
  if (!(mass > 0 && std::isfinite(mass)))
    throw InvalidArgument("the spacecraft has mass " + std::to_string(mass) +
                          " kg, expected a positive one");
  zonal_ = false;
  for (const double J : environment_.planet.J) zonal_ = zonal_ || J != 0;
  perturbed_ = zonal_ || !environment_.third_bodies.empty() || environment_.atmosphere ||
               environment_.solar_pressure;
}

std::optional<double> OrbitMotion::drift_above_surface(OrbitPoint& p, OrbitReal dt) const {
  const OrbitReal radius = environment_.planet.radius;
  const auto sinks = [&](const OrbitPoint& a) { return dot(a.r, a.v) * dt < 0; };
  const auto after = [&](OrbitReal t) -> std::optional<OrbitPoint> {
    try {
      return kepler_flow(mu_, p, t);
    } catch (const InvalidArgument&) {
      return {};  // at the centre
    }
  };
  // The point is below the surface, or it is past a pericentre below the surface, so that the orbit
  // has already crossed the surface.
  const bool sank = sinks(p);
  const auto beyond = [&](const std::optional<OrbitPoint>& a) {
    return !a || mechanics::norm(a->r) < radius || (sank && !sinks(*a));
  };
  const auto end = after(dt);
  bool meets = !end || mechanics::norm(end->r) < radius;
  if (!meets && sank && !sinks(*end)) {
    const auto h = cross(p.r, p.v);
    const OrbitReal h2 = dot(h, h), beta = 2 * mu_ / mechanics::norm(p.r) - dot(p.v, p.v),
                    e2 = 1 - beta * h2 / (mu_ * mu_);
    meets = h2 / (mu_ * (1 + std::sqrt(std::max(e2, OrbitReal(0))))) < radius;
  }
  if (!meets) {
    p = *end;
    return std::nullopt;
  }
  OrbitReal above = 0, below = dt;
  for (int i = 0; i < 64; ++i) {
    const OrbitReal middle = (above + below) / 2;
    (beyond(after(middle)) ? below : above) = middle;
  }
  return double(above);
}

OrbitReal OrbitMotion::energy(const OrbitPoint& p) const {
  return OrbitReal(mass_) * (dot(p.v, p.v) / 2 - mu_ / mechanics::norm(p.r));
}

OrbitReal OrbitMotion::zonal_energy(const OrbitPoint& p) const {
  if (!zonal_) return 0;
  const Planet& planet = environment_.planet;
  Vec3<OrbitReal> ignored;
  return OrbitReal(mass_) * zonal_field<OrbitReal>(mu_, planet.radius, Vec3<OrbitReal>(planet.axis),
                                                   planet.J, p.r, ignored);
}

Vec3<OrbitReal> OrbitMotion::third_body_position(const ThirdBody& body, OrbitReal t) const {
  if (body.ephemeris) return Vec3<OrbitReal>(body.ephemeris->position(double(t)));
  return Vec3<OrbitReal>(kepler_flow(body.total_mu, body.start, double(t)).r);
}

bool OrbitMotion::in_shadow(const Vec3<OrbitReal>& r, const Vec3<OrbitReal>& sun) const {
  const Vec3<OrbitReal> u = (OrbitReal(1) / mechanics::norm(sun)) * sun;
  const OrbitReal along = dot(r, u);
  if (along > 0) return false;
  const Vec3<OrbitReal> off = r - along * u;
  const OrbitReal radius = environment_.planet.radius;
  return dot(off, off) < radius * radius;
}

Vec3<OrbitReal> OrbitMotion::zonal_acceleration(const Vec3<OrbitReal>& r) const {
  const Planet& planet = environment_.planet;
  Vec3<OrbitReal> a;
  zonal_field<OrbitReal>(mu_, planet.radius, Vec3<OrbitReal>(planet.axis), planet.J, r, a);
  return a;
}

/// (a·∂)a of the harmonics' acceleration a at r, by a central difference.
Vec3<OrbitReal> OrbitMotion::change_along_itself(const Vec3<OrbitReal>& r,
                                                 const Vec3<OrbitReal>& a) const {
  const OrbitReal size = mechanics::norm(a);
  if (size == 0) return {0, 0, 0};
  const OrbitReal step = 1e-6L * mechanics::norm(r) / size;
  return (1 / (2 * step)) * (zonal_acceleration(r + step * a) - zonal_acceleration(r - step * a));
}

void OrbitMotion::kick(OrbitPoint& p, OrbitReal t, OrbitReal h, const Vec3<OrbitReal>& gradient,
                       OrbitWorks& works, Surfaces* surfaces, OrbitReal correction) const {
  using V = Vec3<OrbitReal>;
  const Planet& planet = environment_.planet;
  const OrbitReal m = mass_;
  std::array<V, orbit_sources> a;
  a.fill(V{0, 0, 0});
  a[size_t(OrbitSource::gradient)] = gradient;
  if (zonal_) {
    V& zonal = a[size_t(OrbitSource::zonal)];
    zonal = zonal_acceleration(p.r);
    if (correction != 0) zonal += (correction / h) * change_along_itself(p.r, zonal);
  }
  for (const ThirdBody& body : environment_.third_bodies) {
    const V s = third_body_position(body, t);
    a[size_t(OrbitSource::third_body)] += third_body_acceleration<OrbitReal>(body.mu, s, p.r);
    if (environment_.solar_pressure && body.name == "sun" && !in_shadow(p.r, s)) {
      const V away = p.r - s;
      const OrbitReal d2 = dot(away, away);
      const SolarPressure& sp = *environment_.solar_pressure;
      const OrbitReal pressure =
          sp.at_1_au * OrbitReal(astronomical_unit) * OrbitReal(astronomical_unit) / d2;
      const V from = (OrbitReal(1) / sqrtl(d2)) * away;
      V& light = a[size_t(OrbitSource::sunlight)];
      light = (pressure * sp.area_coefficient / m) * from;
      if (surfaces) light += (1 / m) * V(surfaces->light(-Vec3d(from), double(pressure)));
    }
  }
  V fixed{0, 0, 0};
  for (const V& each : a) fixed += each;
  V change = h * fixed;
  if (environment_.atmosphere) {
    const Atmosphere& air = *environment_.atmosphere;
    const OrbitReal altitude = mechanics::norm(p.r) - OrbitReal(planet.radius);
    const OrbitReal density =
        air.density * expl(-(altitude - OrbitReal(air.altitude)) / OrbitReal(air.scale_height));
    const V wind = OrbitReal(*planet.rotation_rate) * cross(V(planet.axis), p.r);
    V& drag = a[size_t(OrbitSource::drag)];
    for (int i = 0; i < 8; ++i) {  // one kick changes v by 1e-6 of it at most: converges at once
      const V through = p.v + OrbitReal(0.5) * change - wind;
      drag = (-density * OrbitReal(air.area_coefficient) / (2 * m) * mechanics::norm(through)) *
             through;
      if (surfaces) drag += (1 / m) * V(surfaces->drag(Vec3d(through), double(density)));
      change = h * (fixed + drag);
    }
  }
  const V mean = p.v + OrbitReal(0.5) * change;
  for (size_t s = 0; s < orbit_sources; ++s) works[s] = m * h * dot(a[s], mean);
  p.v += change;
}

OrbitPropagator::OrbitPropagator(Environment environment, double mass,
                                 const PointState<double>& start, double h,
                                 const std::string& scheme)
    : motion_(std::move(environment), mass), scheme_(split_scheme(scheme)), h_(h) {
  check_orbit(motion_.environment().planet, start, false);
  store_point({Vec3<OrbitReal>(start.r), Vec3<OrbitReal>(start.v)}, x_, lo_);
  energy_0_ = motion_.energy(point());
  zonal_0_ = motion_.zonal_energy(point());
}

void OrbitPropagator::step() {
  OrbitPoint p = point();
  if (!motion_.perturbed()) {
    motion_.drift(p, h_);
  } else {
    OrbitReal t = OrbitReal(steps_) * h_;
    OrbitWorks works;
    for (size_t i = 0; i < scheme_.kick.size(); ++i) {
      if (scheme_.kick[i] != 0) {
        const bool end = i == 0 || i + 1 == scheme_.kick.size();
        motion_.kick(p, t, OrbitReal(scheme_.kick[i]) * h_, {0, 0, 0}, works, nullptr,
                     end ? OrbitReal(scheme_.corrector) * h_ * h_ * h_ : 0);
        for (size_t s = 0; s < orbit_sources; ++s)
          phs::compensated_add(sum_[s], low_[s], double(works[s]));
      }
      if (i == scheme_.drift.size()) break;
      motion_.drift(p, OrbitReal(scheme_.drift[i]) * h_);
      t += OrbitReal(scheme_.drift[i]) * h_;
    }
  }
  store_point(p, x_, lo_);
  ++steps_;
}

double OrbitPropagator::energy_defect() const {
  OrbitReal defect = motion_.energy(point()) - energy_0_;
  for (size_t s = 0; s < orbit_sources; ++s) defect -= OrbitReal(sum_[s]) + low_[s];
  return double(defect);
}

double OrbitPropagator::zonal_defect() const {
  const size_t z = size_t(OrbitSource::zonal);
  return double(motion_.zonal_energy(point()) - zonal_0_ + (OrbitReal(sum_[z]) + low_[z]));
}

}  // namespace porthos::space
