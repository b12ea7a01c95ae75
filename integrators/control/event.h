#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "integrators/core/integrator.h"

/// Events: the first state of a run where a function g(t, x) passes through 0.
namespace porthos::integrators {

/// The direction in which g passes through 0.
enum class Crossing { rising, falling, both };

/// g at time t and state x. x is the value of the state (without its low word); its angles are
/// continuous over a step, not wrapped: let g be 2π-periodic in them (sin, cos) if the event shall
/// come round with every turn.
struct Event {
  std::function<double(double t, std::span<const double> x)> g;
  Crossing direction = Crossing::both;
};

/// How events are looked for.
struct EventOptions {
  /// Points inside a step where the dense output is looked at, besides its ends: two crossings
  /// between neighbours are not seen. Methods without dense output are looked at at the ends alone.
  int samples = 4;
  int most_trials = 60;  ///< re-steps of one search; 4 to 6 are usual
  /// Whole steps stay multiples of h from time 0: the step after an event ends where the one it cut
  /// short would have. What happens at whole steps (sampled controllers, switching thrusters) then
  /// happens when it would without the event.
  bool to_grid = false;
  /// x has its angles with all turns since the start: g may ask how far a joint has turned.
  bool all_turns = false;
};

/// How a step of an EventStepper ended.
struct EventResult {
  Outcome outcome = Outcome::ok;  ///< not ok: the state is the last good one
  int event = -1;                 ///< which of the events, -1: none in this step
  bool rising = false;            ///< g went from below 0 to above
  double g = 0;                   ///< what is left of it at the event state
  int trials = 0;                 ///< re-steps taken to find it
};

/// Steps a run and stops it at events.
///
/// An event state is a step: the method is run again from the last accepted state with the step
/// length at which g vanishes, found by a bracketed secant from a start value of the dense output.
/// It has the method's order and its structure, and the run goes on from it; the interpolated state
/// is looked at but never continued. At rounding, g(event) is as near to 0 as neighbouring step
/// lengths allow.
///
/// A state handed back after an event may have been changed by the caller (a bounce); its g counts
/// as 0 there, with the sign it has at the next sample.
class EventStepper {
 public:
  /// make: gives the integrator, called twice (the run's and one for trials). The model is the one
  /// it steps.
  /// @throws InvalidArgument for an event without g, samples < 0 or most_trials < 1; for sampled
  ///   controllers without to_grid
  EventStepper(const phs::Model& model, const std::function<std::unique_ptr<Integrator>()>& make,
               std::vector<Event> events, const EventOptions& options = {});

  /// One step, shortened to the earliest event in it, and to the time `end`, which lies ahead.
  [[nodiscard]] EventResult step(phs::State& state);
  [[nodiscard]] EventResult step(phs::State& state, double end);
  /// Steps to the next event or to the time `end`, whichever is first; ends exactly there. Both lie
  /// ahead.
  [[nodiscard]] EventResult run_to(phs::State& state, double end);

  Integrator& method() { return *method_; }
  double time(const phs::State& state) const { return method_->time(state); }

 private:
  /// A place inside the step, as a fraction of it, with g of the event in question.
  struct Point {
    double at = 0, g = 0;
  };
  struct Root {
    int event = -1;
    bool rising = false;
    Point point;
  };
  /// Whether a state stands between two whole steps, after an event.
  bool between(const phs::State& s) const;
  /// Puts method and state back to the start of the step.
  void go_back(phs::State& state);
  Outcome begin(phs::State& state);
  /// A step of size h from before_, and the clock after it.
  Outcome odd_step(phs::State& state, double h);
  EventResult finish(phs::State& state);
  void unwrap(const phs::State& s);
  double g_of(const Event& e, double t, const phs::State& s);
  double sampled(const Event& e, double at, const phs::State& after);
  double tried(const Event& e, double at);
  bool search(int event, const phs::State& after, Root& earliest);
  double guess(const Event& e, Point a, Point b, const phs::State& after);
  Point refine(const Event& e, Point a, Point b, double first);

  std::unique_ptr<Integrator> method_, trial_;
  std::vector<Event> events_;
  EventOptions options_;
  std::vector<size_t> angles_;  ///< where the angle blocks stand in x
  bool shortened_ = false;      ///< the last step, to its `end`
  int left_event_ = -1;         ///< the event whose state the step began with
  phs::State before_, tried_;
  double t_ = 0, h_ = 0;  ///< time of before_, size of the step
  Outcome tried_outcome_ = Outcome::ok;
  int trials_ = 0;
  std::vector<double> memory_, held_, x_;
  std::vector<Point> points_;
};

}  // namespace porthos::integrators
