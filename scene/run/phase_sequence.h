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

/// A mechanism between phases, whose centre of mass moves apart from it: the state of its motion
/// about that, which the events change, and in orbit the orbit of that, which they do not.
class OrbitApart {
 public:
  explicit OrbitApart(const Assembly& a)
      : in_orbit_(a.spacecraft != nullptr), centre_apart_(a.centre.has_value()) {}

  /// Takes the orbit off a state.
  void take_off(phs::State& s);
  /// Puts it back.
  void put_back(phs::State& s) const;
  /// The same for the assembly of a phase. @throws InvalidArgument as space::Spacecraft
  void put_back(Assembly& a, const Scene& scene) const;
  /// Leaves no rounding in the linear momentum, which is zero about the centre of mass.
  void settle(mechanics::MovingMechanism& m) const;

 private:
  bool in_orbit_, centre_apart_;
  std::vector<double> x_, lo_;
};

/// The states of motors and actuators, which an event leaves as they are: no impulse passes a
/// winding or a spring.
class MotorStates {
 public:
  explicit MotorStates(const Scene& scene);
  /// Takes them off a state without orbit of an assembly.
  void take_off(const Assembly& a, phs::State& s);
  /// Puts them back behind the mechanism.
  void put_back(const phs::Model& model, phs::State& s) const;

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> x_lo_;
};

/// The outputs of sampled controllers, which an event between two instants leaves as they are. One
/// whose joint was locked in between begins anew, at its next instant.
class HeldOutputs {
 public:
  /// @param memory  of the model's holds, in their order
  void keep(const phs::Model& model, std::span<const double> memory);
  /// As the start of the next phase, whose model has holds of its own.
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

/// A run of one mechanism: from an event to the next, or to the end.
struct Phase {
  Scene scene;  ///< without events; its duration is the phase's end
  Assembly assembly;
  std::vector<integrators::Event> until;  ///< events that wait, as Phase::waiting names them
  std::vector<const Event*> waiting;
  double from = 0;  ///< [s]
};

/// A scene with events as a sequence of runs: which mechanism moves from when to when, what happens
/// in between, and the ledger of the whole. Who runs the phases (into folders, in memory, as a case
/// of an ensemble) is not its business:
///
///     PhaseSequence phases(scene, assembly);
///     while (const Phase* p = phases.next()) phases.done(report of a run of *p);
///     RunReport r = phases.finish();
class PhaseSequence {
 public:
  /// What happens at once at the start has happened then. Scene and assembly must outlive it.
  /// @throws InvalidArgument for an event that cannot be at the start
  PhaseSequence(const Scene& scene, const Assembly& assembly);
  PhaseSequence(const PhaseSequence&) = delete;

  /// The run that is next; null after the last. Valid until done().
  const Phase* next();
  /// Takes a phase's report, and the events at its end happen. One that was interrupted or failed
  /// is the last. @throws InvalidArgument for an event that cannot be (out of reach ...): nothing
  /// of it
  ///   has happened then, and last() is the phase before
  void done(const RunReport& phase);
  /// The report of the whole; adds what is judged of the events themselves.
  RunReport finish();

  const WholeReport& whole() const { return whole_; }
  const std::vector<Happened>& happened() const { return happened_; }
  double now() const { return from_; }  ///< [s]: the end of the last phase
  int count() const { return count_; }  ///< phases done, with one that failed
  /// The assembly that the final state is of.
  const Assembly& last() const { return phase_.assembly; }
  /// Joints that are locked now.
  const std::map<std::string, mechanics::LockedJoint>& locked() const { return moving_.locked; }

 private:
  bool can_happen(const Event& e) const;
  void happen(const Event& e);
  void happen_at_once();
  void assemble(double end);

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
  Phase phase_;
  double from_ = 0;
  int count_ = 0;
  bool more_ = true, broken_off_ = false, assembled_ = false;
};

/// Refuses, before anything runs, what cannot be: events off the steps or outside the run, parts
/// whose state an event would lose, and sequences of events whose mechanisms cannot be assembled.
/// What depends on the motion is left out: positions and rates are those of the start, limits of
/// latches do not count, and an event that waits comes as early as it may.
/// @return the systems of all phases, that of the start first
/// @throws InvalidArgument with file and line
std::vector<std::shared_ptr<const phs::Model>> rehearse(const Scene& scene,
                                                        const Assembly& assembly);

}  // namespace porthos::scene
