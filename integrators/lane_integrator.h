#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/integrator.h"
#include "integrators/stage_lanes.h"
#include "phs/state.h"

namespace porthos::integrators {

/// Runs of one method side by side, each with a state of its own in a SIMD lane and the bits it has alone.
///
/// Lanes keep no step: each begins its next when its own iteration is done, so none waits for another. What lanes do not do
/// — Newton's iteration, or saying why a step failed — they hand over: a stuck lane stands before the step in question,
/// and the Integrator of the same method goes on from state() and memory() with the same bits.
class LaneIntegrator {
 public:
  static constexpr int width = stage_lanes;
  using Lanes = phs::Pack<double, width>;
  using Set = unsigned;  ///< of lanes, a bit each

  LaneIntegrator(const phs::Model& model, double h, const Options& o);
  virtual ~LaneIntegrator() = default;
  LaneIntegrator(const LaneIntegrator&) = delete;
  LaneIntegrator& operator=(const LaneIntegrator&) = delete;

  /// The system all lanes are evaluated with, for parameters that differ from lane to lane (phs/tunable.h). Set them
  /// before load().
  phs::System<Lanes>& system() { return *system_; }

  /// Puts a run into a lane, to stop when `until` steps are counted. Nothing is known of steps before.
  void load(int lane, const phs::State& start, std::int64_t until);
  /// Sends a lane that has arrived on to a later step.
  void go_on(int lane, std::int64_t until);
  /// Takes the run out of a lane.
  void clear(int lane);

  /// Works until lanes have arrived or are stuck; they stay as they are until told otherwise. @return which; 0 if none runs
  Set run();
  bool stuck(int lane) const { return run_[size_t(lane)].phase == Phase::stuck; }

  /// The state of a lane that has arrived or is stuck.
  void state(int lane, phs::State& to) const;
  /// What an Integrator of this method needs to go on from there, for its restore().
  virtual std::vector<double> memory(int lane) const = 0;
  /// Energy through each of the system's powers in the lane's last step [J].
  void works(int lane, std::span<double> to) const;

 protected:
  enum class Phase { idle, sweeping, finishing, arrived, stuck };
  /// What is known of a lane besides its numbers.
  struct Run {
    Phase phase = Phase::idle;
    std::int64_t step = 0, until = 0, origin_step = 0;
    double origin = 0, origin_lo = 0;
    std::vector<std::int64_t> turns;
  };

  static Set bit(int lane) { return 1u << lane; }
  static phs::Mask<width> mask(Set lanes);
  Set in(Phase phase) const;

  /// A new run in a lane: nothing of the one before counts.
  virtual void forget(int lane) = 0;
  /// Begins the next step of some lanes, whose phase is to become sweeping or stuck.
  virtual void begin(Set lanes) = 0;
  /// As much work as lanes do together without asking; moves them from phase to phase, to finished() at the end of a step.
  virtual void advance() = 0;
  /// Adds moves to the states of some lanes whose step is done.
  void add(Set lanes, size_t k, Lanes move);
  /// Counts the step, wraps angles, stops or begins the next.
  void finished(Set lanes);

  const phs::Description& description() const { return system_->description(); }

  double h_;
  Options options_;
  std::unique_ptr<phs::System<Lanes>> system_;
  size_t n_;                   ///< numbers in a state
  std::vector<Lanes> x_, lo_;  ///< states
  std::vector<Lanes> works_;   ///< of the last step of each lane
  Lanes t_ = Lanes(0.0);       ///< where the steps at work began
  std::vector<Run> run_;       ///< of each lane

 private:
  void start(Set lanes);
  void wrap(int lane);
  void tell_turns();

  std::vector<size_t> angles_;     ///< where the angle blocks are
  phs::Description angle_blocks_;  ///< of a state of these alone
  phs::State angle_state_;
  std::vector<Lanes> turn_angles_;
};

/// The lanes of a method on a system, or null where it has none: `method` works without them, or the system's controllers
/// are sampled. The model must outlive it. @throws InvalidArgument as make_integrator
std::unique_ptr<LaneIntegrator> make_lane_integrator(const std::string& method,
                                                     const phs::Model& model, double h,
                                                     const Options& options = {});

}  // namespace porthos::integrators
