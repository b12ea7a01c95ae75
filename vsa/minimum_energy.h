#pragma once
#include <vector>

#include "vsa/actuator.h"

/// Stiffness changes with minimum energy.
namespace porthos::vsa {

/// From σ0 to σ1, at rest at both ends, in `duration`, with constant deflection φ = q - θ.
struct StiffnessChange {
  double deflection = 0;    ///< φ [rad]
  double from = 0, to = 0;  ///< σ
  double duration = 0;      ///< T [s], > 0
  double winding_loss =
      0;  ///< c [W/(N m)²], > 0, of the torque at the gear's output: R/(k_t n)², k_t [N m/A]
};

/// The motion of σ that minimises
///
///   ∫ τ σ' + c τ² dt,   τ = n² J σ'' + n² b σ' + ∂E/∂σ(φ, σ):
///
/// the energy drawn at the motor's terminals, where energy returned by the spring is fed back. In
/// it, ∫ τ σ' is the work at the stiffness port: ΔE of the spring, which is the same for every
/// path, and the loss by the viscous friction n² b. Without a winding loss there is no minimum,
/// because a constant rate between two impulses is only approached. A drive with b = 0 minimises
/// just the effort integral ∫ τ².
struct StiffnessPlan {
  double duration = 0;
  std::vector<double> powers;  ///< σ = Σ powers[k] u^k, u = 2 t/T - 1
  double spring = 0;           ///< ΔE [J]
  double friction = 0;         ///< lost to viscous friction [J]
  double winding = 0;          ///< lost in the windings [J]
  double peak_torque = 0;      ///< the largest |τ| [N m], at 64 points
  /// remaining gradient with respect to the basis, relative to its terms, at the end of Newton's
  /// iteration
  double stationarity = 0;
  phs::FunctionPtr torque;  ///< τ(t), the command of the drive; it holds σ1 after T and σ0 before 0

  double work() const { return spring + friction; }          ///< at the stiffness port [J]
  double electrical() const { return work() + winding; }     ///< the minimised energy [J]
  double sigma(double t) const { return derivative(0, t); }  ///< 0 <= t <= T, also for the others
  double rate(double t) const { return derivative(1, t); }
  double acceleration(double t) const { return derivative(2, t); }

 private:
  double derivative(int order, double t) const;
};

/// The path among polynomials of degree 15 with both ends at rest, by Newton's method with Fejér's
/// quadrature. It is exact to round-off for a constant pull of the spring without friction. With
/// friction the path has layers of thickness 1/κ = n² J √(c / (c (n² b)² + n² b)) at its ends: σ is
/// within 1e-8 of the change for κ T <= 10, and within 1e-4 for 40. `drive` is the motor at σ, of
/// kind torque, without friction other than viscous and without limits, which would distort the
/// torque. Cost: a millisecond.
/// @throws InvalidArgument as constant_energy_path(), for a drive of another kind, a number out of
/// range, a search that does not converge, or an optimal path that leaves the range of σ
StiffnessPlan minimum_energy_change(const ElasticPtr& e, const Drive& drive,
                                    const StiffnessChange& change);

}  // namespace porthos::vsa
