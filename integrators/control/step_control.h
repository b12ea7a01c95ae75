#pragma once
#include <memory>
#include <string>

#include "integrators/core/integrator.h"
#include "phs/system/time_scale.h"

/// Steps of varying size that preserve structure. With an ordinary controller, based on an error
/// estimate, the step depends on the history of the run. The energy of a symplectic or symmetric
/// method then drifts as with any other method.
///
/// If a step would pass one of Options::instants, or an instant of a sampled controller, the plain
/// method repeats it up to that instant, and the control restarts behind it.
namespace porthos::integrators {

/// How the step size depends on the state.
enum class StepControl {
  fixed,
  /// constant steps of the transformed system sigma (H - H0): symplectic, any step-size ratio
  time_transformed,
  /// an explicit controller that is time-reversible and cheaper; for time-reversible systems
  reversible
};
/// Its name in scenes.
const char* to_string(StepControl c);
/// @throws InvalidArgument for an unknown name, which lists the known ones
StepControl step_control_of(const std::string& name);

/// The parameters of a step control.
struct ControlOptions {
  /// sigma(x) > 0: the ratio of the step at x to the step `h` of the integrator. Null: a
  /// RateTimeScale of the model with the two numbers below.
  std::shared_ptr<const phs::TimeScaleModel> scale = nullptr;
  /// [rad/s], of RateTimeScale; 0: 1/|h|, so that no step turns a coordinate by more than one
  /// radian
  double rate = 0;
  double length = 0;  ///< [m], of RateTimeScale
};

/// A method of the catalogue with constant steps h of fictitious time. step() moves the state by
/// about h sigma(x) and its clock by the time that the method computes. Internally the method works
/// on phs::TimeTransformedModel with p_t = -H(x) of its first state. memory() contains it. A state
/// other than the last one restarts the method. Order, symmetry and symplecticity are those of the
/// method. Quadratic invariants are conserved if sigma is invariant under their symmetry. step_by()
/// is the plain method in physical time. interpolate() takes fractions of physical time. The model
/// must outlive it.
/// @throws InvalidArgument as make_integrator and phs::RateTimeScale, for a method that chooses its
///   own steps, and for one that cannot take the transformed system (it is not separable)
std::unique_ptr<Integrator> make_time_transformed(const std::string& method,
                                                  const phs::Model& model, double h,
                                                  const ControlOptions& control = {},
                                                  const Options& options = {});

/// A symmetric method with the step sizes h/rho of Hairer and Soderlind (SIAM J. Sci. Comput. 26,
/// 2005; Hairer, Lubich, Wanner 2006, VIII.3.2):
///
///   rho_{n+1/2} = rho_{n-1/2} + h G(x_n),   G = -d/dt log sigma(x(t)),   rho_0 = 1/sigma(x_0),
///
/// It is explicit, with one O(n) evaluation per step. memory() contains its value at whole steps,
/// rho_n = rho_{n-1/2} + h G(x_n)/2. An integrator made with -h and given this memory goes back
/// through the same steps. sigma must be even under time reversal. Quadratic invariants and exact
/// energy are conserved if the method conserves them; symplecticity is lost. It is free of drift on
/// time-reversible systems only: on damped systems rho need not stay near 1/sigma. Outcome::failed
/// if rho would become negative or zero: use a smaller h.
/// @throws InvalidArgument as make_time_transformed, and for a method that is not declared
///   symmetric
std::unique_ptr<Integrator> make_reversible(const std::string& method, const phs::Model& model,
                                            double h, const ControlOptions& control = {},
                                            const Options& options = {});

/// One of the three controls; `fixed` gives make_integrator.
std::unique_ptr<Integrator> make_controlled(StepControl kind, const std::string& method,
                                            const phs::Model& model, double h,
                                            const ControlOptions& control = {},
                                            const Options& options = {});

}  // namespace porthos::integrators
