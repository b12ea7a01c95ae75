#pragma once
#include <atomic>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "integrators/control/event_gradient.h"
#include "scene/sensitivity/event_chain.h"
#include "scene/sensitivity/inputs.h"

namespace porthos::scene {

/// A run of a scene with events, as integrators::gradients_across_events() takes it: a phase for
/// each mechanism, and between two of them what all events of that instant make of the state, of
/// the places that they lock or catch, and of the inertias.
///
/// A place that an event makes a constant of the mechanism is a parameter of the phases that follow
/// (phs::VariedModel), which the event sets. An event that joins bodies keeps momenta, p⁺ = Jᵀp⁻,
/// and needs no inertia; one that frees them keeps rates, p⁺ = M⁺(θ) v(M⁻(θ)⁻¹ p⁻).
class EventRun {
 public:
  /// Runs the scene. Scene and assembly must outlive it.
  /// @param instead  the way out, at the end of a refusal
  /// @throws InvalidArgument as differentiable_steps() in any phase, for parts with states of their
  ///   own, step controls, an event at the start, one that engages a latch or closes or opens a
  ///   loop, one that is impossible
  EventRun(const Scene& scene, const Assembly& assembly, const std::string& instead,
           const std::atomic<bool>* stop);
  EventRun(const EventRun&) = delete;
  ~EventRun();

  /// Why the run ended before its end; empty: it did not.
  const std::string& failure() const { return failure_; }
  const std::vector<integrators::RunPhase>& phases() const { return phases_; }
  /// The numbers of events that have slopes, by the names of their parameters there: "event[0].at".
  const std::vector<Input>& inputs() const { return inputs_; }
  /// Sentences on events that never happened.
  const std::vector<std::string>& notes() const { return notes_; }
  /// The last phase.
  const Scene& last_scene() const { return made_.back().scene; }
  const Assembly& last() const { return made_.back().assembly; }
  /// The last phase with places changed that are constants of it, at each of
  /// phs::difference_points, by parameter.
  const std::map<std::string, std::vector<std::pair<Scene, Assembly>>>& beside() const {
    return beside_;
  }

 private:
  struct Slopes;  ///< a matrix
  /// A phase that has run.
  struct Made {
    Scene scene;
    Assembly assembly;
    size_t before = 0;           ///< events before it
    const Event* met = nullptr;  ///< the event that it waited for and met
    double end = 0;              ///< [s]
  };
  /// What ended a phase: the limit of a waiting event that was met last, or a time.
  struct End {
    Event event;         ///< with that limit alone
    std::string number;  ///< its key
    double value = 0;
    bool timed = true;
    std::vector<double> by_state = {}, by_parameters = {};
  };

  void run(const std::string& instead, const std::atomic<bool>* stop);
  std::pair<size_t, size_t> events_after(size_t phase) const;
  End end_of(size_t phase) const;
  double margin(const mechanics::MovingMechanism& moving, const Event& e) const;
  double condition(const mechanics::MovingMechanism& moving, const End& end) const;
  void see_beside(size_t number, size_t point);
  std::vector<double> by_inertias(const mechanics::MovingMechanism& moving,
                                  std::span<const double> lambda) const;
  integrators::RunEvent event_after(size_t phase);
  Slopes slopes_of(size_t i) const;
  void add_guard(integrators::RunEvent& e, const End& end,
                 const mechanics::MovingMechanism& there) const;
  Input input_of(const End& end) const;

  const Scene& scene_;
  const Assembly& assembly_;
  std::string failure_;
  std::vector<std::string> notes_;
  std::unique_ptr<EventChain> chain_;
  std::vector<Made> made_;
  std::vector<End> ends_;              ///< of all phases but the last
  std::vector<std::string> inertias_;  ///< parameters of all mechanisms; none of models by duals
  std::vector<Slopes> frozen_;         ///< of each event: slopes of what it leaves by the places
  std::vector<std::vector<phs::Variation>> variations_;  ///< by phase
  std::vector<std::shared_ptr<const phs::Model>> models_;
  std::vector<integrators::RunPhase> phases_;
  std::vector<Input> inputs_;
  std::map<std::string, std::vector<std::pair<Scene, Assembly>>> beside_;
};

}  // namespace porthos::scene
