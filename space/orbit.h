#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "space/environment.h"

/// The centre of mass of a spacecraft on its orbit: the exact Kepler flow, and kicks by all other
/// forces.
namespace porthos::space {

struct SplitScheme;
class Surfaces;

/// The scalar of orbits: a 64-bit significand, stored as value + low word. One rounding of a 7000
/// km position is then 4e-13 m, instead of 9e-10 m for a double.
using OrbitReal = long double;
using OrbitPoint = PointState<OrbitReal>;

/// Reads x + lo and writes it back: six numbers r, v.
OrbitPoint load_point(std::span<const double> x, std::span<const double> lo);
void store_point(const OrbitPoint& p, std::span<double> x, std::span<double> lo);

/// Sources that change the orbital energy besides the central gravity.
enum class OrbitSource { zonal, gradient, third_body, drag, sunlight, thrust, count };
inline constexpr size_t orbit_sources = size_t(OrbitSource::count);
const char* to_string(OrbitSource s);
/// Work on the orbital motion by each source [J].
using OrbitWorks = std::array<OrbitReal, orbit_sources>;

/// The motion of a centre of mass: exact Kepler flow, kicks by all other forces, works by source.
class OrbitMotion {
 public:
  /// @throws InvalidArgument as Environment::validate(), or for a mass that is not positive
  OrbitMotion(Environment environment, double mass);
  const Environment& environment() const { return environment_; }
  double mass() const { return mass_; }

  /// The exact Kepler flow over dt.
  void drift(OrbitPoint& p, OrbitReal dt) const { p = kepler_flow(mu_, p, dt); }

  /// drift(), unless the path goes below the planet's surface. Then p is unchanged, and the time
  /// until the surface is returned [s]. The whole path is checked, so that a passage through the
  /// planet between two steps is detected. |dt|: less than half a revolution.
  std::optional<double> drift_above_surface(OrbitPoint& p, OrbitReal dt) const;

  /// The change of velocity over h by all other forces, at a fixed position and time t. `gradient`:
  /// acceleration of the centre of mass by the gravity gradient. Drag, which depends on the
  /// velocity, is evaluated at the mean of both ends (implicit midpoint). works: written; their sum
  /// is the change of m v²/2 to rounding, whatever the step. surfaces: plates at their attitude,
  /// whose forces are added; null: none. correction: c h³ of a corrected splitting, which adds
  /// (a·∂)a times it to the kick of the harmonics a.
  void kick(OrbitPoint& p, OrbitReal t, OrbitReal h, const Vec3<OrbitReal>& gradient,
            OrbitWorks& works, Surfaces* surfaces = nullptr, OrbitReal correction = 0) const;

  /// m (v²/2 - μ/r) [J].
  OrbitReal energy(const OrbitPoint& p) const;
  /// Potential energy of the zonal harmonics at p [J].
  OrbitReal zonal_energy(const OrbitPoint& p) const;
  /// Whether a kick has other forces than the gravity gradient.
  bool perturbed() const { return perturbed_; }
  /// Position of a third body at t, relative to the planet [m].
  Vec3<OrbitReal> third_body_position(const ThirdBody& body, OrbitReal t) const;

 private:
  Vec3<OrbitReal> zonal_acceleration(const Vec3<OrbitReal>& r) const;
  Vec3<OrbitReal> change_along_itself(const Vec3<OrbitReal>& r, const Vec3<OrbitReal>& a) const;
  bool in_shadow(const Vec3<OrbitReal>& r, const Vec3<OrbitReal>& sun) const;
  Environment environment_;
  double mass_;
  OrbitReal mu_;
  bool zonal_, perturbed_;
};

/// An orbit alone, with its ledger: E(t) - E(0) = Σ works to rounding; the zonal potential balances
/// to the scheme's order.
class OrbitPropagator {
 public:
  /// @param mass    [kg]
  /// @param start   position [m] and velocity [m/s] about the planet, inertial axes
  /// @param h       step [s]
  /// @param scheme  a name of split_schemes()
  /// @throws InvalidArgument for an unknown scheme, a mass or an environment out of range, and a
  ///   start that check_orbit() refuses
  OrbitPropagator(Environment environment, double mass, const PointState<double>& start, double h,
                  const std::string& scheme = "strang");
  void step();
  double time() const { return double(steps_) * h_; }
  OrbitPoint point() const { return load_point(x_, lo_); }
  const OrbitMotion& motion() const { return motion_; }
  /// Work of each source since the start [J].
  double work(OrbitSource s) const { return sum_[size_t(s)] + low_[size_t(s)]; }
  /// E - E(0) - Σ works [J]: rounding only.
  double energy_defect() const;
  /// V_zonal - V_zonal(0) + work of the zonals [J]: the error of the splitting, bounded if it is
  /// symplectic.
  double zonal_defect() const;

 private:
  OrbitMotion motion_;
  const SplitScheme& scheme_;
  double h_;
  std::int64_t steps_ = 0;
  std::array<double, 6> x_{}, lo_{};
  std::array<double, orbit_sources> sum_{}, low_{};
  OrbitReal energy_0_ = 0, zonal_0_ = 0;
};

}  // namespace porthos::space
