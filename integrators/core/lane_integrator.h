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

/// Runs of one method side by side, each with a state of its own in a SIMD lane and the bits it has
/// alone.
///
/// Lanes keep no step: each begins its next when its own iteration is done, so none waits for
/// another. What lanes do not do — Newton's iteration, or saying why a step failed — they hand
/// over: a stuck lane stands before the step in question, and the Integrator of the same method
/// goes on from state() and memory() with the same bits.
class LaneIntegrator {
 public:
  static constexpr int width = stage_lanes;
  using Lanes = phs::Pack<double, width>;
  using Set = LaneSet;

  LaneIntegrator(const phs::Model& model, double h, const Options& o);
  virtual ~LaneIntegrator() = default;
  LaneIntegrator(const LaneIntegrator&) = delete;
  LaneIntegrator& operator=(const LaneIntegrator&) = delete;

  /// The system all lanes are evaluated with, for parameters that differ from lane to lane
  /// (phs/system/tunable.h). Set them before load().
  phs::System<Lanes>& system() { return *system_; }

  /// Puts a run into a lane, to stop when `until` steps are counted. Nothing is known of steps
  /// before.
  void load(int lane, const phs::State& start, std::int64_t until);
  /// Sends a lane that has arrived on to a later step.
  void go_on(int lane, std::int64_t until);
  /// Takes the run out of a lane.
  void clear(int lane);

  /// Works until lanes have arrived or are stuck; they stay as they are until told otherwise.
  /// @return which; 0 if none runs
  Set run();
  bool stuck(int lane) const { return run_[size_t(lane)].phase == Phase::stuck; }

  /// The state of a lane that has arrived or is stuck.
  void state(int lane, phs::State& to) const;
  /// What an Integrator of this method needs to go on from there, for its restore().
  virtual std::vector<double> memory(int lane) const = 0;
  /// Energy through each of the system's powers in the lane's last step [J].
  void port_work(int lane, std::span<double> to) const;

 protected:
  /// A new run in some lanes: nothing of the ones before counts.
  virtual void forget(Set lanes) = 0;
  /// Begins the next step of some lanes. @return those that cannot go on side by side
  virtual Set begin(Set lanes) = 0;
  /// As much work as lanes do together without asking, and which of their steps ended with it.
  /// Those that are done are in the states.
  virtual Ended round(Set lanes) = 0;

  double h_;
  Options options_;
  std::unique_ptr<phs::System<Lanes>> system_;
  size_t n_;                         ///< numbers in a state
  std::vector<Lanes> x_, lo_;        ///< states
  Lanes t_ = Lanes(0.0);             ///< where the steps at work began
  PortWork<Lanes> ended_port_work_;  ///< of the steps that the last round ended
  Cost cost_;                        ///< of rounds

 private:
  enum class Phase { idle, working, arrived, stuck };
  /// What is known of a lane besides its numbers.
  struct Run {
    Phase phase = Phase::idle;
    phs::State
        clock;  ///< and the turns; of the numbers it has the angles alone, and only to wrap them
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
  std::vector<size_t> angles_;     ///< where the angle blocks are
  phs::Description angle_blocks_;  ///< of a state of these alone
  std::vector<Lanes> turn_angles_;
};

/// The lanes of a method on a system, or null where it has none: `method` works without them, or
/// the system's controllers are sampled. The model must outlive it. @throws InvalidArgument as
/// make_integrator
std::unique_ptr<LaneIntegrator> make_lane_integrator(const std::string& method,
                                                     const phs::Model& model, double h,
                                                     const Options& options = {});

}  // namespace porthos::integrators
