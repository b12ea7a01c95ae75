#pragma once
#include <memory>
#include <string>

#include "integrators/core/integrator.h"
#include "phs/system/time_scale.h"

/// Steps of varying size that keep the structure. A controller that looks at an error estimate
/// makes the step depend on where the run came from; the energy of a symplectic or symmetric method
/// then drifts as that of any other.
///
/// A step that would pass one of Options::instants, or an instant of a sampled controller, is taken
/// again up to there by the plain method, and the control begins anew behind it.
namespace porthos::integrators {

/// How the size of the steps follows the state.
enum class StepControl {
  fixed,
  /// constant steps of the transformed system sigma (H - H0): symplectic, any step-size ratio
  time_transformed,
  /// an explicit controller that runs backwards as it ran forwards: cheaper, time-reversible
  /// systems
  reversible
};
/// Its name in scenes.
const char* to_string(StepControl c);
/// @throws InvalidArgument for an unknown name, which lists the known ones
StepControl step_control_of(const std::string& name);

/// What a step control goes by.
struct ControlOptions {
  /// sigma(x) > 0, the step at x over the step `h` that the integrator is made with. None: a
  /// RateTimeScale of the model with the two numbers below.
  std::shared_ptr<const phs::TimeScaleModel> scale = nullptr;
  /// [rad/s], of RateTimeScale; 0: 1/|h|, so that no step turns a coordinate by more than a radian
  double rate = 0;
  double length = 0;  ///< [m], of RateTimeScale
};

/// A method of the catalogue with constant steps h of fictitious time: step() moves the state by
/// about h sigma(x), its clock by what the method says. Inside, the method works on
/// phs::TimeTransformedModel with p_t = -H(x) of the state it was first given; memory() holds it,
/// and a state that is not the one it left behind starts anew. Order, symmetry and symplecticity
/// are the method's. Quadratic invariants survive if sigma is invariant under their symmetry.
/// step_by() is the plain method in physical time. interpolate() takes fractions of physical time.
/// The model must outlive it.
/// @throws InvalidArgument as make_integrator; for a method that chooses its steps itself; for one
///   the transformed system does not suit (it is not separable); and as phs::RateTimeScale
std::unique_ptr<Integrator> make_time_transformed(const std::string& method,
                                                  const phs::Model& model, double h,
                                                  const ControlOptions& control = {},
                                                  const Options& options = {});

/// A symmetric method with the step sizes h/rho of Hairer and Soderlind (SIAM J. Sci. Comput. 26,
/// 2005; Hairer, Lubich, Wanner 2006, VIII.3.2):
///
///   rho_{n+1/2} = rho_{n-1/2} + h G(x_n),   G = -d/dt log sigma(x(t)),   rho_0 = 1/sigma(x_0),
///
/// explicit, one O(n) evaluation a step, kept at whole steps as rho_n = rho_{n-1/2} + h G(x_n)/2 in
/// memory(). An integrator made with -h that is given this memory goes back through the same steps.
/// sigma must be even under the reversal of time. Quadratic invariants and exact energy are kept
/// where the method keeps them, symplecticity is not; without drift on time-reversible systems
/// only: of damped ones rho need not stay near 1/sigma. Outcome::failed where rho would not stay
/// positive: take a smaller h.
/// @throws InvalidArgument as make_time_transformed, and for a method that is not declared
///   symmetric
std::unique_ptr<Integrator> make_reversible(const std::string& method, const phs::Model& model,
                                            double h, const ControlOptions& control = {},
                                            const Options& options = {});

/// One of the three; `fixed` is make_integrator.
std::unique_ptr<Integrator> make_controlled(StepControl kind, const std::string& method,
                                            const phs::Model& model, double h,
                                            const ControlOptions& control = {},
                                            const Options& options = {});

}  // namespace porthos::integrators
