#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "integrators/control/event.h"
#include "mechanics/reconfiguration.h"
#include "scene/run/latching.h"
#include "scene/run/whole_report.h"

namespace porthos::scene {

/// A mechanism between phases whose centre of mass is integrated separately: events change the
/// state of the motion about the centre of mass, and in orbit they do not change the orbit.
class OrbitApart {
 public:
  explicit OrbitApart(const Assembly& a)
      : in_orbit_(a.spacecraft != nullptr), centre_apart_(a.centre.has_value()) {}

  /// Removes the orbit from a state.
  void take_off(phs::State& s);
  /// Puts it back.
  void put_back(phs::State& s) const;
  /// The same for the assembly of a phase. @throws InvalidArgument as space::Spacecraft
  void put_back(Assembly& a, const Scene& scene) const;
  /// Removes rounding errors from the linear momentum, which is zero about the centre of mass.
  void settle(mechanics::MovingMechanism& m) const;

 private:
  bool in_orbit_, centre_apart_;
  std::vector<double> x_, lo_;
};

/// The states of motors, actuators and bristles. An event does not change them, because no impulse
/// passes a winding or a spring; one at a locked joint waits.
class MotorStates {
 public:
  explicit MotorStates(const Scene& scene);
  /// Removes them from a state, without orbit, of an assembly.
  void take_off(const Assembly& a, phs::State& s);
  /// Puts them back behind the mechanism.
  void put_back(const phs::Model& model, phs::State& s) const;

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> x_lo_;
};

/// The outputs of sampled controllers. An event between two sampling instants does not change them.
/// A controller whose joint was locked in between restarts at its next instant.
class HeldOutputs {
 public:
  /// @param memory  of the model's holds, in their order
  void keep(const phs::Model& model, std::span<const double> memory);
  /// Sets them as the start of the next phase, whose model has holds of its own.
  void put_in(const phs::Model& model) const;

 private:
  std::map<std::string, std::vector<double>> values_;
};

/// An event that has happened.
struct Happened {
  const Event* event;
  double at;  ///< [s]
  mechanics::Impact impact;
};

/// What the events have joined and locked by now.
/// @param whole  the mechanism before all of them
Joined joined_by(const std::vector<Happened>& happened, const mechanics::MovingMechanism& moving,
                 const mechanics::MechanicalModel& whole);

/// A run of one mechanism: from an event to the next, or to the end.
struct Phase {
  Scene scene;  ///< without events; its duration is the phase's end
  Assembly assembly;
  std::vector<integrators::Event> until;  ///< waiting events, as Phase::waiting names them
  std::vector<const Event*> waiting;
  double from = 0;  ///< [s]
};

/// A scene with events as a sequence of runs: which mechanism moves during which time, what happens
/// in between, and the ledger of the whole. The caller runs the phases (into folders, in memory, or
/// as a case of an ensemble):
///
///     PhaseSequence phases(scene, assembly);
///     while (const Phase* p = phases.next()) phases.done(report of a run of *p);
///     RunReport r = phases.finish();
class PhaseSequence {
 public:
  /// Applies the events that happen at the start. Scene and assembly must outlive it.
  /// @throws InvalidArgument for an event that is impossible at the start
  PhaseSequence(const Scene& scene, const Assembly& assembly);
  PhaseSequence(const PhaseSequence&) = delete;

  /// The run that is next; null after the last. Valid until done().
  const Phase* next();
  /// Takes a phase's report and applies the events at its end. A phase that was interrupted or
  /// failed is the last. @throws InvalidArgument for an event that is impossible (out of reach
  /// ...): then nothing of it has been applied, and last() is the phase before
  void done(const RunReport& phase);
  /// Ends the run before an event that done() found impossible: a failed check, and a note of why
  /// after those of missed().
  void give_up(const std::string& why);
  /// A sentence on each event that still waits: what keeps it, and when it was nearest.
  std::vector<std::string> missed() const;
  /// The report of the whole; adds the checks of the events themselves.
  RunReport finish();

  const WholeReport& whole() const { return whole_; }
  const std::vector<Happened>& happened() const { return happened_; }
  double now() const { return from_; }  ///< [s]: the end of the last phase
  int count() const { return count_; }  ///< phases done, including a failed one
  /// The assembly to which the final state belongs.
  const Assembly& last() const { return phase_.assembly; }
  /// The mechanism between two phases, before the first one with its events of the start.
  const mechanics::MovingMechanism& moving() const { return moving_; }
  /// Joints that are locked now.
  const std::map<std::string, mechanics::LockedJoint>& locked() const { return moving_.locked; }

 private:
  bool can_happen(const Event& e) const;
  void happen(const Event& e);
  void happen_at_once();
  void assemble(double end);
  bool stopped();
  void tell_missed(int others = 0);

  const Scene& scene_;
  const Assembly& whole_assembly_;
  OrbitApart orbit_;
  MotorStates motors_;
  mechanics::MovingMechanism moving_;
  HeldOutputs held_;
  Latching latching_;
  std::vector<const Event*> waiting_;
  WholeReport whole_;
  std::vector<Happened> happened_;
  phs::State watched_;
  /// Where the condition of an event that waits came nearest to be met since it waits, and what
  /// kept it.
  struct Nearest {
    double margin = -HUGE_VAL, time = 0;
    std::vector<double> x = {};
    std::string then = {};
  };
  void remember_nearest();

  std::map<const Event*, Nearest> nearest_, nearest_of_all_;  ///< of this phase, of those before
  Phase phase_;
  double from_ = 0;
  int count_ = 0;
  bool more_ = true, broken_off_ = false, assembled_ = false;
};

/// Refuses impossible scenes before anything runs: events that are not at whole steps or are
/// outside the run, parts whose state an event would lose, and sequences of events whose mechanisms
/// cannot be assembled. Conditions that depend on the motion are not checked: positions and rates
/// are those of the start, limits of latches do not count, and a waiting event happens as early as
/// it may.
/// @return the systems of all phases, that of the start first
/// @throws InvalidArgument with file and line
std::vector<std::shared_ptr<const phs::Model>> rehearse(const Scene& scene,
                                                        const Assembly& assembly);

}  // namespace porthos::scene
