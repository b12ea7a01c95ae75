#pragma once
#include <vector>

#include "vsa/actuator.h"

/// Changing the stiffness with the least energy.
namespace porthos::vsa {

/// From σ0 to σ1, at rest at both ends, in `duration`, the deflection φ = q - θ held all the time.
struct StiffnessChange {
  double deflection = 0;    ///< φ [rad]
  double from = 0, to = 0;  ///< σ
  double duration = 0;      ///< T [s], > 0
  double winding_loss =
      0;  ///< c [W/(N m)²], > 0, of the torque at the gear's output: R/(k_t n)², k_t [N m/A]
};

/// What moves σ with the least
///
///   ∫ τ σ' + c τ² dt,   τ = n² J σ'' + n² b σ' + ∂E/∂σ(φ, σ):
///
/// the energy the motor's terminals take up, what the spring gives back being fed back. Of it, ∫ τ
/// σ' is the work at the stiffness port: ΔE of the spring, which no path changes, and the loss to
/// the viscous friction n² b. Without a winding loss there is no least: a constant rate between two
/// impulses is only approached. The effort integral ∫ τ² alone is
/// what a drive with b = 0 minimises.
struct StiffnessPlan {
  double duration = 0;
  std::vector<double> powers;  ///< σ = Σ powers[k] u^k, u = 2 t/T - 1
  double spring = 0;           ///< ΔE [J]
  double friction = 0;         ///< lost to viscous friction [J]
  double winding = 0;          ///< lost in the windings [J]
  double peak_torque = 0;      ///< the largest |τ| [N m], at 64 places
  /// what is left of the slope along a path of the basis, relative to its terms: Newton's end
  double stationarity = 0;
  phs::FunctionPtr
      torque;  ///< τ(t), the command of the drive; after T what holds σ1, before 0 what holds σ0

  double work() const { return spring + friction; }          ///< at the stiffness port [J]
  double electrical() const { return work() + winding; }     ///< what was minimised [J]
  double sigma(double t) const { return derivative(0, t); }  ///< 0 <= t <= T, as the others
  double rate(double t) const { return derivative(1, t); }
  double acceleration(double t) const { return derivative(2, t); }

 private:
  double derivative(int order, double t) const;
};

/// The path among polynomials of degree 15 with both ends at rest, by Newton's method on Fejér's
/// quadrature. Exact to round-off for a constant pull of the spring without friction; with friction
/// the path has layers of thickness 1/κ = n² J √(c / (c (n² b)² + n² b)) at its ends: σ is within
/// 1e-8 of the change for κ T <= 10, 1e-4 for 40. `drive` is the motor at σ, of kind torque,
/// without friction other than viscous and without limits: they would bend the torque. Cost: a
/// millisecond.
/// @throws InvalidArgument as constant_energy_path(), for a drive of another kind, a number out of
///   its range, a search that does not converge, or a best path that leaves the range of σ
StiffnessPlan minimum_energy_change(const ElasticPtr& e, const Drive& drive,
                                    const StiffnessChange& change);

}  // namespace porthos::vsa
