#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "space/gravity.h"
#include "space/kepler.h"

/// The environment of a spacecraft's centre of mass, as given by the user.
namespace porthos::space {

using Vec3d = Vec3<double>;

/// A magnetic dipole at the planet's centre.
struct MagneticDipole {
  double equator = 0;    ///< field at its equator, at Planet::radius [T]
  double tilt = 0;       ///< of its north pole from the planet's axis [rad]
  double longitude = 0;  ///< of its north pole at time 0, from the inertial x about the axis [rad]
};

/// The body at the origin of the inertial axes.
struct Planet {
  std::string name = "earth";
  double mu = 398600441500000.0;  ///< [m³/s²]; default: EGM96
  double radius = 6378136.3;      ///< equatorial, the a of the J_n [m]
  Vec3d axis{0, 0, 1};            ///< unit axis of symmetry and rotation, inertial
  Zonals J{0, 0, 0, 0, 0};        ///< J_2 … J_6
  std::optional<MagneticDipole> magnetic;
  std::optional<double> rotation_rate;  ///< [rad/s] about the axis; for drag and tilted dipoles
};
/// J_2 … J_6 of the Earth, from the normalised C_n0 of EGM96 (Lemoine et al. 1998,
/// NASA/TP-1998-206861).
Zonals earth_zonals();

/// Position as a function of date, relative to the planet's centre, inertial axes [m]; t [s] from
/// the start of the run.
class Ephemeris {
 public:
  virtual ~Ephemeris() = default;
  virtual Vec3d position(double t) const = 0;
};

/// A perturbing body on a fixed ellipse about the planet (for the Sun: the planet's orbit as seen
/// from the planet).
struct ThirdBody {
  std::string name;
  double mu = 0;             ///< [m³/s²]
  PointState<double> start;  ///< relative to the planet at time 0, inertial axes
  double total_mu = 0;       ///< μ of its relative motion: planet and body together
  std::shared_ptr<const Ephemeris> ephemeris = {};  ///< replaces the ellipse, see ephemeris.h
};
/// The state on a Keplerian ellipse with these elements [m, -, rad].
PointState<double> from_elements(double mu, double semi_major_axis, double eccentricity,
                                 double inclination, double node, double argument,
                                 double true_anomaly);
/// Sun and Moon on mean ellipses in the equatorial axes of J2000, from their mean longitudes at the
/// start [rad]. They give the size and period of the perturbation and are no ephemeris (see
/// dated_body). Errors against ERFA, 2026 to 2030 (ephemeris_test): for the Sun at most 0.4
/// degrees. For the Moon, with its perigee and node of the date, 3 degrees at the start, due to
/// evection and variation. With perigee and node of J2000, the defaults, which rotate once in 8.85
/// and 18.6 years, 15 degrees.
ThirdBody mean_sun(double mean_longitude_at_start);
ThirdBody mean_moon(double mean_longitude_at_start, double longitude_of_perigee = 1.4547886,
                    double longitude_of_node = 2.1824391);

/// A flat part of a link's surface, see plates.h. Use two plates for the two sides of a panel.
struct Plate {
  std::string link;
  double area = 0;        ///< [m²]
  Vec3d normal{0, 0, 1};  ///< outward, any length, in the link's frame
  Vec3d place{0, 0, 0};   ///< its centre of pressure, in the link's frame [m]
  double drag = 0;        ///< C_D for the area across the stream; 0: none
  double specular = 0,
         diffuse = 0;  ///< fractions of light reflected and scattered; the rest is absorbed
  std::string where;   ///< "file:line", for errors
};

/// ρ = ρ_0 exp(-(altitude - altitude_0)/scale height), rotating with the planet.
struct Atmosphere {
  double density = 0;           ///< ρ_0 [kg/m³]
  double altitude = 0;          ///< [m] above Planet::radius
  double scale_height = 0;      ///< [m]
  double area_coefficient = 0;  ///< C_D A of the spacecraft as a sphere [m²]; 0: plates only
};

/// Pressure of sunlight on a sphere; requires the third body "sun". Shadow: a cylinder behind the
/// planet.
struct SolarPressure {
  double area_coefficient = 0;  ///< C_R A [m²] of a sphere; 0: plates only
  double at_1_au = 4.56e-6;     ///< [N/m²]
};

/// The forces on an orbit. Entries that are not set are not computed.
struct Environment {
  Planet planet;
  std::vector<ThirdBody> third_bodies;
  double greenwich = 0;  ///< its angle from the x axis at time 0 [rad], by the epoch; for pictures
  std::optional<Atmosphere> atmosphere;
  std::optional<SolarPressure> solar_pressure;
  std::vector<Plate> plates;

  /// @throws InvalidArgument with one sentence: a parameter out of range, drag without a rotating
  ///   planet, sunlight without a sun
  void validate() const;
};

/// The same with its time counted from `elapsed` [s]: bodies, the dipole's pole and the planet's
/// angle are then where they were.
Environment counted_from(Environment environment, double elapsed);

/// What acts besides the planet's central field and the gravity gradient, in words: "the Sun",
/// "J2", "drag".
std::vector<std::string> forces_of(const Environment& environment);

/// The osculating orbit of a state.
struct Elements {
  double semi_major_axis, eccentricity, inclination, node, argument, true_anomaly;  ///< [m, -, rad]
  double period;      ///< [s]; infinite if not bound
  double pericentre;  ///< [m] from the centre
};
Elements elements_of(double mu, const PointState<double>& s);

/// @throws InvalidArgument for a pericentre below the planet's surface, or for an orbit that is not
///   bound although `bound` is set
void check_orbit(const Planet& planet, const PointState<double>& start, bool bound);

}  // namespace porthos::space
