#pragma once
#include <span>
#include <vector>

#include "space/environment.h"
#include "space/link_forces.h"

/// Drag and sunlight on flat plates of a spacecraft's links: forces and torques that depend on the
/// attitude.
namespace porthos::space {

/// What a kick asks of a surface: positions stand still, so its forces depend on the orbit's
/// velocity and the Sun alone.
class Surfaces {
 public:
  virtual ~Surfaces() = default;
  /// The whole force in a stream of density ρ [kg/m³] that passes at `through` = v - wind [m/s],
  /// inertial axes [N].
  virtual Vec3d drag(const Vec3d& through, double density) = 0;
  /// The whole force of light of a pressure [N/m²] from the unit direction `to_sun`, inertial axes
  /// [N].
  virtual Vec3d light(const Vec3d& to_sun, double pressure) = 0;
};

/// On each plate with outward normal n, area A, at its centre of pressure:
///   drag       -½ ρ C_D A (n·v/|v|)⁺ |v| v,      v: of the centre of mass through the air
///              (a link's own motion is 1e-5 of it)
///   sunlight   -P A (n·s)⁺ [(1 - ρ_s) s + 2 (ρ_s n·s + ρ_d/3) n],      s: towards the Sun
/// Plates do not shade each other. As the frame falls with the centre of mass, each link feels in
/// return its share of the whole force, -m_i F/m: what is left are torques and joint forces.
/// Source: Wertz 1978, section 17.2, equations 17-52 and 17-57.
class PlateForces final : public Surfaces {
 public:
  /// @throws InvalidArgument as LinkForces; for an unknown link
  PlateForces(const Mechanism& m, const std::vector<Plate>& plates);
  /// At coordinates q; no forces yet.
  void place(std::span<const double> q);
  Vec3d drag(const Vec3d& through, double density) override;
  Vec3d light(const Vec3d& to_sun, double pressure) override;
  /// Joint forces of what drag() and light() gave last.
  void project();
  std::span<const double> joint_forces() const { return on_.joint_forces(); }
  const Vec3d& torque() const { return on_.torque(); }
  void momentum_rates(std::span<const double> q, std::span<double> p_dot) const {
    on_.momentum_rates(q, p_dot);
  }
  void set_turn_angles(std::span<const double> angles) { on_.set_turn_angles(angles); }

 private:
  struct OnNode {
    Plate plate;
    size_t node;
    Vec3d normal, place;   ///< in the node's frame
    Vec3d n, drag, light;  ///< in the base's axes
  };
  LinkForces<double> on_;
  std::vector<OnNode> plates_;
  double mass_;
};

}  // namespace porthos::space
