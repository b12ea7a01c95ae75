#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "integrators/core/integrator.h"

/// Events: the first state of a run where a function g(t, x) passes through 0.
namespace porthos::integrators {

/// The direction in which g passes through 0.
enum class Crossing { rising, falling, both };

/// A function g of time t and state x. x is the state without its low word; its angles are
/// continuous over a step, not wrapped. Make g 2π-periodic in them (sin, cos) if the event shall
/// occur on every turn.
struct Event {
  std::function<double(double t, std::span<const double> x)> g;
  Crossing direction = Crossing::both;
  /// Of a rising event that g must exceed, not reach: g up to this, 0 or more, counts as before it.
  /// Where g rests between 0 and this, the event is at the instant at which it leaves.
  std::optional<double> beyond = {};
};

/// Options of the search for events.
struct EventOptions {
  /// Points inside a step, besides its ends, at which the dense output is evaluated. Two crossings
  /// between neighbouring points are missed. Without dense output only the ends are used.
  int samples = 4;
  int most_trials = 60;  ///< re-steps per search; 4 to 6 are usual
  /// Whole steps stay multiples of h from time 0: the step after an event ends where the
  /// interrupted step would have ended. What happens at whole steps (sampled controllers, switching
  /// thrusters) then happens at the same times as without the event.
  bool to_grid = false;
  /// The angles of x include all turns since the start, so that g can depend on how far a joint
  /// turned.
  bool all_turns = false;
};

/// How a step of an EventStepper ended.
struct EventResult {
  Outcome outcome = Outcome::ok;  ///< not ok: the state is the last good one
  int event = -1;                 ///< index of the event, -1: none in this step
  bool rising = false;            ///< g changed from negative to positive
  double g = 0;                   ///< the remaining g at the event state
  int trials = 0;                 ///< re-steps taken to find it
};

/// Steps a run and stops it at events.
///
/// An event state is the result of a step. The method is run again from the last accepted state
/// with the step length at which g vanishes. A bracketed secant method finds that length, starting
/// from the dense output. The event state thus has the order and structure of the method, and the
/// run continues from it. Interpolated states are only evaluated, never continued. At convergence
/// g(event) is as close to 0 as neighbouring step lengths allow.
///
/// The caller may change the state after an event (a bounce). Its g then counts as 0, with the sign
/// that g has at the next sample.
class EventStepper {
 public:
  /// make: creates the integrator; it is called twice (for the run and for trials). The model is
  /// the one that is integrated.
  /// @throws InvalidArgument for an event without g or with another `beyond`, samples < 0 or
  ///   most_trials < 1; for sampled controllers without to_grid
  EventStepper(const phs::Model& model, const std::function<std::unique_ptr<Integrator>()>& make,
               std::vector<Event> events, const EventOptions& options = {});

  /// One step, shortened to the earliest event in it or to the time `end`, which must lie ahead.
  [[nodiscard]] EventResult step(phs::State& state);
  [[nodiscard]] EventResult step(phs::State& state, double end);
  /// Steps to the next event or to the time `end`, whichever is first, and ends exactly there. Both
  /// lie ahead.
  [[nodiscard]] EventResult run_to(phs::State& state, double end);

  Integrator& method() { return *method_; }
  double time(const phs::State& state) const { return method_->time(state); }

 private:
  /// A point inside the step, as a fraction of it, with g of the event there.
  struct Point {
    double at = 0, g = 0;
  };
  struct Root {
    int event = -1;
    bool rising = false;
    Point point;
  };
  /// Whether a state lies between two whole steps, after an event.
  bool between(const phs::State& s) const;
  /// Resets method and state to the start of the step.
  void go_back(phs::State& state);
  Outcome begin(phs::State& state);
  /// A step of size h from before_, with the clock after it.
  Outcome odd_step(phs::State& state, double h);
  EventResult finish(phs::State& state);
  void unwrap(const phs::State& s);
  double g_of(const Event& e, double t, const phs::State& s);
  double sampled(const Event& e, double at, const phs::State& after);
  double tried(const Event& e, double at);
  bool search(int event, const phs::State& after, Root& earliest);
  Point leave(const Event& e, double from, Point to);
  Point settle(const Event& e, Point a, Point b, double first);

  std::unique_ptr<Integrator> method_, trial_;
  std::vector<Event> events_;
  EventOptions options_;
  std::vector<size_t> angles_;  ///< offsets of the angle blocks in x
  bool shortened_ = false;      ///< the last step was shortened, to its `end`
  int left_event_ = -1;         ///< the event at whose state the step began
  phs::State before_, tried_;
  double t_ = 0, h_ = 0;  ///< time of before_, size of the step
  Outcome tried_outcome_ = Outcome::ok;
  int trials_ = 0;
  std::vector<double> memory_, held_, x_;
  std::vector<Point> points_;
};

}  // namespace porthos::integrators
