#pragma once
#include <span>
#include <vector>

#include "space/environment.h"
#include "space/link_forces.h"
#include "space/parts.h"

namespace porthos::space {

/// Field of the planet's dipole at r and t, inertial axes [T]: B0 (a/r)³ (k - 3 (k·u) u), k its
/// north, B0 the magnitude at the equator and a the planet's radius. A tilted dipole rotates with
/// the planet.
/// @throws InvalidArgument for a planet without a dipole
Vec3d magnetic_field(const Planet& planet, const Vec3d& r, double t);

/// Thrusters, wrenches and torquers of a spacecraft in orbit: kicks at fixed positions. A force
/// moves the centre of mass. The internal motion, whose linear momentum stays zero, receives the
/// rest: the force on its link and -m_i/m of it on each link's centre.
class OrbitPush {
 public:
  /// @throws InvalidArgument as PartsModel; for torquers about a planet without a field
  OrbitPush(const mechanics::Mechanism& m, const Parts& parts, const Planet& planet);

  /// Evaluates at the state x = (q, p, ...) with the centre of mass at R. The thrusters are on or
  /// off as at `when`, the middle of a step, whatever the instant t of the kick.
  void evaluate(std::span<const double> x, const Vec3d& R, double t, double when);
  size_t count() const { return pushes_.size(); }
  /// Joint forces of one part, size nv. Those of the base are the torque about the centre of mass,
  /// and the force that makes the sum over all floating trees zero.
  std::span<const double> joint_forces(size_t k) const { return pushes_[k].force; }
  /// Force on the centre of mass and torque about it, inertial axes [N, N m].
  const Vec3d& force(size_t k) const { return pushes_[k].on_centre; }
  const Vec3d& torque(size_t k) const { return pushes_[k].torque; }
  /// Adds the contribution of joint forces to p', size nq.
  void momentum_rates(std::span<const double> q, std::span<const double> joint_forces,
                      std::span<double> p_dot) const;
  void set_turn_angles(std::span<const double> angles);

 private:
  struct Push {
    std::vector<double> force;
    Vec3d on_centre{0, 0, 0}, torque{0, 0, 0};
  };
  /// @param load  of thruster or wrench k at its place, link's or inertial axes
  void push(size_t k, std::span<const double> q, mechanics::Force<double> load, bool in_world);

  const mechanics::Mechanism& m_;
  LinkForces<double> on_;
  const Parts& parts_;
  const Planet& planet_;
  std::vector<Pose> place_;  ///< of thrusters, then of wrenches: in the node's frame
  std::vector<int> node_;
  std::vector<std::vector<WheelAxis>> wheels_;
  std::vector<Push> pushes_;
};

}  // namespace porthos::space
