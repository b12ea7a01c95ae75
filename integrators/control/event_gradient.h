#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "integrators/control/event.h"
#include "integrators/derivatives/run_gradient.h"
#include "phs/functions/law.h"

/// Gradients of runs that jump: bounces, locks and releases, forces that switch on.
namespace porthos::integrators {

/// What ends a part of a run, in duals, so that it has derivatives. Angles of x have all their
/// turns.
struct RunEvent {
  using In = std::span<const phs::Dual>;

  std::string name;
  /// The instant is its zero, as Event::g. Null: the instant is the time `at`.
  std::function<phs::Dual(In numbers, const phs::Dual& t, In x)> guard = {};
  Crossing direction = Crossing::rising;
  double at = 0;  ///< [s], after the start
  /// The state after it, of the phase that follows. Null: the same.
  std::function<void(In numbers, const phs::Dual& t, In x, std::span<phs::Dual> after)> reset = {};
  /// Its own numbers, which are parameters: a restitution, a place.
  std::vector<phs::LawGain> numbers = {};
  int then = -1;      ///< the phase that follows; -1: the same
  bool ends = false;  ///< it ends the run, after its reset
  /// Parameters of the models that guard and reset depend on besides. They get them behind the
  /// numbers, as changes: 0.
  std::vector<std::string> parameters = {};
  /// Parameters of the models that follow which the event decides: a place at which something is
  /// locked from then on. The reset gives their changes behind the state.
  std::vector<std::string> sets = {};
};

/// A part of a run: its model, and what may end it.
struct RunPhase {
  const phs::Model* model;
  std::vector<RunEvent> events = {};
};

/// The cost of such a run, as Objective: end(t_N, x_N) + Σ_n sampled(t_n, x_n), the second over the
/// ends of steps that no event cuts.
struct EventObjective {
  Objective::Part end = {}, sampled = {};
  /// ∂end/∂t, for a run that an event ends; empty: 0.
  std::function<double(double t, std::span<const double> x)> end_by_time = {};
  /// ∂end/∂θ at that state, by names of parameters of the models; empty: 0.
  std::function<std::map<std::string, double>(double t, std::span<const double> x)>
      end_by_parameters = {};
};

/// How such a gradient is computed.
struct EventGradientOptions {
  size_t memory = size_t(64) << 20;  ///< of each part, as GradientOptions
  /// Of a guard's rate at its zero, against its change over a step: below it the event grazes.
  double grazing = 1e-6;
  int most_events = 100000;
  const std::atomic<bool>* stop = nullptr;  ///< true: give up; the outcome is then `failed`
};

/// An event that happened.
struct HappenedEvent {
  size_t phase, event;
  double t;     ///< [s]
  double rate;  ///< of its guard along the steps [1/s]; NaN at a given time
};

/// The gradient of the cost of such a run.
struct EventGradient {
  Outcome outcome = Outcome::ok;  ///< if not ok, the gradients mean nothing
  std::string remark;             ///< then: where and why
  double cost = 0;                ///< J
  double time = 0;                ///< of the end [s]
  phs::State end;                 ///< of the last phase
  std::vector<double> start;      ///< ∂J/∂x_0
  /// Those of the phases' models, by name, then "<event>.<number>", and "<event>.at" of an event at
  /// a given time.
  std::vector<std::string> names;
  std::vector<double> parameters;  ///< ∂J/∂θ with x_0 kept
  std::vector<HappenedEvent> events;
};

/// The gradient of a run with events, from the first of the phases and time 0. A step is cut at the
/// instant t* of an event, and the next one ends where the whole step would have ended. With the
/// derivative of the cut step by its size, Φ_h, and the rate of the guard ġ = ∇g·Φ_h + ∂g/∂t,
///
///   δt* = -(∇g·Φ_x δx + g_θ δθ)/ġ,   δx⁺ = R_x (Φ_x δx + Φ_h δt*) + R_t δt* + R_θ δθ
///
/// and the rest of the step begins later and is shorter by δt*. In the limit of small steps this is
/// the saltation matrix R_x + (f⁺ - R_x f⁻ - R_t) ∇gᵀ/ġ; here it is the derivative of the steps as
/// they are computed, to rounding. What a reset makes of the masses of the model is not in the
/// slopes by these, unless they are among its numbers or parameters. "<event>.at" of a time at the
/// end of a whole step is right to the method's error.
/// @param start  at time 0, of phases[0]
/// @param duration  of the run [s], > 0, unless an event ends it earlier
/// @throws InvalidArgument as gradient_of_run(); for sampled controllers; for methods whose steps
///   have no derivative by their size (discrete gradients, splittings, Störmer-Verlet with
///   quaternions); for a phase, a time or a reset that is not there
EventGradient gradient_across_events(const std::string& method, const std::vector<RunPhase>& phases,
                                     const phs::State& start, double h, double duration,
                                     const EventObjective& objective,
                                     const EventGradientOptions& options = {});
/// The gradients of any number of costs of one run, `objectives`, in their order and with the bits
/// of each alone: the run is shared.
/// @throws InvalidArgument as gradient_across_events()
std::vector<EventGradient> gradients_across_events(const std::string& method,
                                                   const std::vector<RunPhase>& phases,
                                                   const phs::State& start, double h,
                                                   double duration,
                                                   std::span<const EventObjective> objectives,
                                                   const EventGradientOptions& options = {});

/// The change of a run with events along a direction.
struct EventTangent {
  Outcome outcome = Outcome::ok;  ///< if not ok, it means nothing
  std::string remark;             ///< then: where and why
  phs::State end;                 ///< of the last phase
  std::vector<double> change;     ///< of that state
  double time_change = 0;         ///< of its time, where an event ends the run [s]
};

/// The tangent of the same run along a change of its start and of the numbers of its events. Their
/// product with ∂J/∂x_N, ∂J/∂t_N is that of the gradient with the direction, to rounding.
/// @param direction  δx_0, size nx of the first phase
/// @param numbers  δθ by names as EventGradient::names; others are 0
/// @throws InvalidArgument as gradient_across_events(), for a name that no event has, and for an
///   event that sets parameters
EventTangent tangent_across_events(const std::string& method, const std::vector<RunPhase>& phases,
                                   const phs::State& start, double h, double duration,
                                   std::span<const double> direction,
                                   const std::map<std::string, double>& numbers = {},
                                   const EventGradientOptions& options = {});

}  // namespace porthos::integrators
