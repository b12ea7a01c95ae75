#pragma once
#include <span>
#include <vector>

#include "space/environment.h"
#include "space/link_forces.h"

/// Drag and sunlight on flat plates of a spacecraft's links: forces and torques that depend on
/// attitude.
namespace porthos::space {

/// Surface forces for a kick. Positions are fixed, so the forces depend on the orbital velocity and
/// the Sun alone.
class Surfaces {
 public:
  virtual ~Surfaces() = default;
  /// The total force of a stream of density ρ [kg/m³] with relative velocity `through` = v - wind
  /// [m/s], inertial axes [N].
  virtual Vec3d drag(const Vec3d& through, double density) = 0;
  /// The total force of light with a pressure [N/m²] from the unit direction `to_sun`, inertial
  /// axes [N].
  virtual Vec3d light(const Vec3d& to_sun, double pressure) = 0;
};

/// Forces on each plate with outward normal n and area A, at its centre of pressure:
///   drag       -½ ρ C_D A (n·v/|v|)⁺ |v| v,      v: of the centre of mass through the air
///              (a link's own motion is 1e-5 of it)
///   sunlight   -P A (n·s)⁺ [(1 - ρ_s) s + 2 (ρ_s n·s + ρ_d/3) n],      s: towards the Sun
/// Plates do not shade each other. Because the frame falls with the centre of mass, each link also
/// has an inertial force, its share -m_i F/m of the total force. What remains are torques and joint
/// forces. Source: Wertz 1978, section 17.2, equations 17-52 and 17-57.
class PlateForces final : public Surfaces {
 public:
  /// @throws InvalidArgument as LinkForces; for an unknown link
  PlateForces(const Mechanism& m, const std::vector<Plate>& plates);
  /// At coordinates q; resets the forces.
  void place(std::span<const double> q);
  Vec3d drag(const Vec3d& through, double density) override;
  Vec3d light(const Vec3d& to_sun, double pressure) override;
  /// Computes the joint forces of the last drag() and light().
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
