#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/lane_set.h"
#include "integrators/core/stage_lanes.h"
#include "phs/system/state.h"

namespace porthos::integrators {

/// Runs of one method side by side. Each has its own state in a SIMD lane and gives the same bits
/// as alone.
///
/// Lanes are not synchronised by steps: each starts its next step when its own iteration is done,
/// so none waits for another. Lanes do not perform Newton's iteration and do not explain failed
/// steps. Such a lane is stuck before the step in question. The Integrator of the same method then
/// continues from state() and memory() with the same bits.
class LaneIntegrator {
 public:
  static constexpr int width = stage_lanes;
  using Lanes = phs::Pack<double, width>;
  using Set = LaneSet;

  LaneIntegrator(const phs::Model& model, double h, const Options& o);
  virtual ~LaneIntegrator() = default;
  LaneIntegrator(const LaneIntegrator&) = delete;
  LaneIntegrator& operator=(const LaneIntegrator&) = delete;

  /// The system that evaluates all lanes, for parameters that differ between lanes
  /// (phs/system/tunable.h). Set them before load().
  phs::System<Lanes>& system() { return *system_; }

  /// Puts a run into a lane, which stops when its step count is `until`. Earlier steps are unknown.
  void load(int lane, const phs::State& start, std::int64_t until);
  /// Continues a lane that has arrived, to a later step.
  void go_on(int lane, std::int64_t until);
  /// Removes the run from a lane.
  void clear(int lane);

  /// Works until some lanes have arrived or are stuck. They stay so until the caller acts.
  /// @return those lanes; 0 if none runs
  Set run();
  /// Rounds of work so far, counted for each lane that worked in one.
  std::int64_t rounds_of_lanes() const { return cost_.sweeps; }
  bool stuck(int lane) const { return run_[size_t(lane)].phase == Phase::stuck; }

  /// The state of a lane that has arrived or is stuck.
  void state(int lane, phs::State& to) const;
  /// The memory from which an Integrator of this method continues, for its restore().
  virtual std::vector<double> memory(int lane) const = 0;
  /// Energy through each of the system's powers in the lane's last step [J].
  void port_work(int lane, std::span<double> to) const;

 protected:
  /// Some lanes have a new run: discards what depends on earlier ones.
  virtual void forget(Set lanes) = 0;
  /// Starts the next step of some lanes. @return those that cannot continue side by side
  virtual Set begin(Set lanes) = 0;
  /// One round of work for all lanes; returns which steps ended with it. The states of finished
  /// ones are up to date.
  virtual Ended round(Set lanes) = 0;

  double h_;
  Options options_;
  std::unique_ptr<phs::System<Lanes>> system_;
  size_t n_;                         ///< numbers in a state
  std::vector<Lanes> x_, lo_;        ///< states
  Lanes t_ = Lanes(0.0);             ///< start times of the current steps
  PortWork<Lanes> ended_port_work_;  ///< of the steps that ended in the last round
  Cost cost_;                        ///< of rounds

 private:
  enum class Phase { idle, working, arrived, stuck };
  /// The bookkeeping of a lane.
  struct Run {
    Phase phase = Phase::idle;
    phs::State clock;  ///< with the turns; its x has only the angles, for wrapping
    std::int64_t until = 0;
  };
  Set in(Phase phase) const;
  void put(int lane, const phs::State& state);
  void start(Set lanes);
  void ended(const Ended& e);
  void wrap(Run& run, int lane);
  void tell_turns();

  std::vector<Lanes> port_work_;   ///< of the last step of each lane
  std::vector<Run> run_;           ///< of each lane
  std::vector<size_t> angles_;     ///< offsets of the angle blocks
  phs::Description angle_blocks_;  ///< of a state with only these
  std::vector<Lanes> turn_angles_;
};

/// The lanes of a method on a system. Null if the method has none or the system's controllers are
/// sampled. The model must outlive it. @throws InvalidArgument as make_integrator
std::unique_ptr<LaneIntegrator> make_lane_integrator(const std::string& method,
                                                     const phs::Model& model, double h,
                                                     const Options& options = {});

}  // namespace porthos::integrators
