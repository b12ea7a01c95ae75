#pragma once
#include <string>
#include <vector>

#include "phs/system/varied_model.h"
#include "scene/run/phase_parts.h"

/// The events of a run, one after another, and what they make of changes.
namespace porthos::scene {

/// A number that an event takes from the state and makes a constant of the mechanism: a coordinate
/// of a joint that locks; of a body that is caught its place in the frame of the link [m], or a
/// turn in its own axes [rad].
struct FrozenNumber {
  size_t happening;  ///< which event
  int number;        ///< of that event
  std::string name;
};

/// An event that happened, and what it changed.
struct Happening {
  Event event;   ///< with its time, without limits
  size_t phase;  ///< that it ended
  mechanics::MovingMechanism before;
  Latching latching;                     ///< before
  std::vector<size_t> coordinates = {};  ///< of a joint that locks: their offsets in the state
  mechanics::Pose pose = {};             ///< of a body that is caught, in the frame of the link
};

/// What an event leaves: the state, with all turns, and its frozen numbers.
using Left = std::vector<double>;

/// The derivative of a vector along one number, by difference_points.
/// @param f  the vector with the number changed by d;  distance: of the nearest points
template <class F>
std::vector<double> difference_of(const F& f, double distance) {
  std::vector<double> slope;
  for (const auto& p : phs::difference_points) {
    const auto values = f(p.at * distance);
    slope.resize(values.size(), 0.0);
    for (size_t i = 0; i < values.size(); ++i) slope[i] += p.weight / distance * values[i];
  }
  return slope;
}

/// The chain of events of one run of a scene. What an event makes of a change is found by the event
/// itself, in 113 bits, at states and places beside those of the run.
class EventChain {
 public:
  /// Scene and assembly must outlive it.
  EventChain(const Scene& scene, const Assembly& assembly, const mechanics::MovingMechanism& start);

  /// Adds an event that happened at the end of a phase: any but one that engages a soft latch or
  /// closes a loop, whose frozen numbers are not known. `state` is that of the end for the first
  /// event there; null: what the event before left.
  void add(const Event& event, double at, size_t phase, const phs::State* state);

  const std::vector<Happening>& list() const { return list_; }
  const std::vector<FrozenNumber>& frozen() const { return frozen_; }
  /// The mechanism and the latches after all of them.
  const mechanics::MovingMechanism& now() const { return moving_; }

  /// Mechanism and latches on a way beside that of the run.
  struct Beside {
    mechanics::MovingMechanism moving;
    Latching latching;
  };
  /// Applies event i, and leaves what is after it.
  Left apply(size_t i, Beside& b) const;
  /// The same with its frozen numbers as they are on the run, whatever the way.
  void apply_as_on_run(size_t i, Beside& b) const;
  /// What event i leaves of a state with number k of it changed by d.
  Left with_state(size_t i, size_t k, double d) const;
  /// The way with a frozen number changed by d, after its own event.
  Beside with_frozen(const FrozenNumber& number, double d) const;
  /// The scene and the assembly of the phase that such a way leads to.
  std::pair<Scene, Assembly> phase_after(const Beside& b, double end) const;
  /// Whether a frozen number is still a constant of the mechanism after `count` events.
  bool lasts(const FrozenNumber& number, size_t count) const;

 private:
  const Scene& scene_;
  const Assembly& whole_;
  OrbitApart orbit_;
  MotorStates motors_;
  mechanics::MovingMechanism moving_;
  Latching latching_;
  std::vector<Happening> list_;
  std::vector<FrozenNumber> frozen_;
};

/// x + lo of a state of a mechanism with all turns.
std::vector<double> whole_state(const mechanics::MovingMechanism& moving);

/// "event[0]", the key of an event by its place in the file.
std::string key_of(const Scene& scene, const Event& e);

}  // namespace porthos::scene
