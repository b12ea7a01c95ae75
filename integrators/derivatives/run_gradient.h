#pragma once
#include <atomic>
#include <functional>

#include "integrators/derivatives/step_variation.h"

namespace porthos::integrators {

/// The cost of a run, J = end(t_N, x_N) + Σ_n sampled(t_n, x_n) + Σ h b_i running(t_i, Y_i): the
/// second over the ends of all steps, the third over their stages, which is the integral by the
/// quadrature of the method. Any part may be empty. They are called from the last step to the
/// first.
struct Objective {
  /// The value at time t [s] and state x, with its angles unwrapped; writes ∂/∂x. Sizes nx.
  using Part =
      std::function<double(double t, std::span<const double> x, std::span<double> gradient)>;
  Part end, sampled, running;

  /// The Hessian of a part at (t, x) times v. With a GradientOptions::direction; where it is empty,
  /// a central difference of the gradient stands in, exact for quadratic parts but for rounding
  /// (1e-11 of the gradient), with an error of some 1e-10 for others.
  using Curvature = std::function<void(double t, std::span<const double> x,
                                       std::span<const double> v, std::span<double> product)>;
  Curvature end_curvature = {}, sampled_curvature = {}, running_curvature = {};
};

/// A step that a run took.
struct TakenStep {
  double size;               ///< [s]
  double origin, origin_lo;  ///< the clock after it (phs::State)
};

/// How a gradient is computed.
struct GradientOptions {
  /// Bytes for the stages and checkpoints of a run. If all stages fit, the run is taken once; else
  /// it is taken again in segments, from checkpoints at two levels or more. Of radau15, whose steps
  /// contain others, the first step tells what a step needs.
  size_t memory = size_t(64) << 20;
  /// δx_0, size nx: products with the Hessian too, tangent over adjoint. Empty: none.
  std::vector<double> direction = {};
  /// δθ of the parameters, size of RunGradient::names: the direction goes along these too. Empty:
  /// none.
  std::vector<double> parameter_direction = {};
  bool has_direction() const { return !direction.empty() || !parameter_direction.empty(); }
  double last = 0;  ///< a last step of another size after the others [s]; 0: none
  /// The steps of a run under a step control (taken_steps()), instead of steps h; empty: none.
  /// Their sizes are constants of the gradient, which is exact for this sequence of steps.
  std::span<const TakenStep> taken = {};
  const std::atomic<bool>* stop = nullptr;         ///< true: give up; the outcome is then `failed`
  std::function<void(double done)> progress = {};  ///< the share of the work done, 0 to 1
};

/// The gradient of a run's cost.
struct RunGradient {
  Outcome outcome = Outcome::ok;  ///< if not ok, the gradients mean nothing
  std::string remark;             ///< then: where and why
  double cost = 0;                ///< J
  phs::State end;                 ///< the last state
  std::vector<double> start;      ///< ∂J/∂x_0, size nx
  /// Of parameters, as phs::Linearised::parameters(), then "<controller>.<gain>" of sampled laws
  /// with gains.
  std::vector<std::string> names;
  std::vector<double> parameters;  ///< ∂J/∂θ with x_0 kept
  /// The changes of `start` and `parameters` along the direction of the options, exact to rounding
  /// as these: ∂²J/∂x_0² δx_0 + ∂²J/∂x_0∂θ δθ and ∂²J/∂θ∂x_0 δx_0 + ∂²J/∂θ² δθ. Empty without one.
  std::vector<double> start_along, parameters_along;
  /// ∂J/∂T by the duration, all steps made longer alike, if no part of J depends on t itself; NaN
  /// for a field that does, with sampled controllers, and without steps [1/s].
  double duration = 0;
  /// log10 |∂J/∂x_0| / |∂end/∂x_N|, NaN without an end cost: over many Lyapunov times it is large,
  /// and the gradient, though exact, tells nothing of a finite change.
  double growth = 0;
  std::int64_t steps_taken = 0;  ///< by the method, repeated ones included
  Cost adjoint;                  ///< of the adjoint
};

/// The gradient of a run of `steps` steps h [s] with respect to its start and the parameters of the
/// model, by the discrete adjoint: exact to rounding for the numbers that the run computes. What
/// sampled controllers hold and remember is a part of the state, and their gains are parameters.
/// Its cost does not depend on the number of parameters. Low words, wrapping and turns have
/// derivative one. The state is unchanged.
/// @throws InvalidArgument as StepPieces; for another number of `steps` than of
///   GradientOptions::taken, and for a `last` step besides these; for a model with constraints; for
///   a sampled law without derivatives, and for sampled controllers with a direction, with discrete
///   gradients and splittings; with a direction as make_second_adjoint()
RunGradient gradient_of_run(const std::string& method, const phs::Model& model,
                            const phs::State& start, double h, std::int64_t steps,
                            const Objective& objective, const GradientOptions& options = {});
/// The gradients of any number of costs of one run, `objectives`, in their order and with the bits
/// of each alone: the run is shared, each cost has its own adjoint.
/// @throws InvalidArgument as gradient_of_run()
std::vector<RunGradient> gradients_of_run(const std::string& method, const phs::Model& model,
                                          const phs::State& start, double h, std::int64_t steps,
                                          std::span<const Objective> objectives,
                                          const GradientOptions& options = {});

}  // namespace porthos::integrators
