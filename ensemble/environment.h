#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ensemble/held_inputs.h"
#include "ensemble/random.h"
#include "integrators/core/turns.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

namespace porthos::ensemble {

class LaneTeam;

/// How many environments, and what a step of theirs is.
struct EnvironmentOptions {
  int count = 1;  ///< environments side by side
  std::string method = "gauss4";
  double step = 0.01;  ///< of the method [s]
  int substeps = 1;    ///< steps an action is held for
  std::uint64_t seed = 0;
  std::int64_t longest = 0;  ///< actions after which an episode is cut off; 0: never
  int threads = 1;           ///< 0: as many as the machine has
  /// Ports that actions drive, by name; empty: all of them. The others are at 0.
  std::vector<std::string> ports = {};
  /// State numbers that are observed; empty: all of them.
  std::vector<int> observed = {};
  bool outputs = false;  ///< whether y of the ports that are driven is observed after them
  /// Where an episode begins: changes x (nx numbers, `start` of the environment at first), with
  /// random numbers of the episode's own.
  std::function<void(Stream& random, std::span<double> x)> begin = {};
  /// Whether an episode has ended at x, by reaching or leaving something. Called by any thread.
  std::function<bool(std::span<const double> x)> ended = {};
};

/// Environments for learning and planning: reset, act, observe, over a batch.
///
/// An action is a row of port inputs u, held over `substeps` steps; rewards are the caller's, from
/// observations and actions. A step depends on an environment's state and its action alone: on no
/// thread, lane, neighbour or earlier step, so that planners may put states back. Random numbers
/// belong to (seed, environment, episode): the same seed and actions give the same bits. An
/// environment whose episode ends — reached, cut off, or the method failed — begins the next in the
/// same step; its last observation is in final_observations().
///
/// All arrays are contiguous, a row per environment: count × action_size() and so on. They stay
/// valid, and are written by reset() and step(). Use from one thread.
class Environment {
 public:
  /// @param start  state numbers an episode begins from, nx
  /// @throws InvalidArgument for unknown ports or state numbers, sizes that do not fit, a model
  ///   with sampled controllers, and as integrators::make_integrator
  Environment(std::shared_ptr<const phs::Model> model, std::vector<double> start,
              EnvironmentOptions options);
  ~Environment();

  int count() const { return o_.count; }
  int action_size() const { return int(driven_.size()); }
  int observation_size() const { return int(observed_.size() + (o_.outputs ? driven_.size() : 0)); }
  /// Seconds from action to action.
  double interval() const { return o_.step * o_.substeps; }
  const phs::Model& model() const { return model_.plant(); }

  /// Begins the first episode of a seed in every environment; without one, the next episode.
  void reset(std::optional<std::uint64_t> seed = {});
  /// @param actions  count × action_size(). @throws InvalidArgument for another size or a number
  ///   that is not finite
  void step(std::span<const double> actions);

  std::span<const double> observations() const { return observations_; }
  /// Of the environments whose episode ended in the last step, what was observed at its end; else
  /// as observations().
  std::span<const double> final_observations() const { return final_; }
  /// 1 where an episode ended in the last step: by `ended` or a failure; by its length; by a
  /// failure.
  std::span<const std::uint8_t> terminated() const { return terminated_; }
  std::span<const std::uint8_t> truncated() const { return truncated_; }
  std::span<const std::uint8_t> failed() const { return failed_; }
  /// H of each environment [J].
  std::span<const double> energies() const { return energies_; }
  /// Steps taken in the episode, and its number.
  std::span<const std::int64_t> lengths() const { return lengths_; }
  std::span<const std::int64_t> episodes() const { return episodes_; }

  /// The state of an environment, and another one put in its place (its episode goes on).
  const phs::State& state(int environment) const { return states_[size_t(environment)]; }
  void set_state(int environment, const phs::State& state);

 private:
  class Turn;
  void begin(int environment);
  /// Writes the observation and the energy.
  void observe(int environment, std::span<double> to);

  HeldInputs model_;
  std::vector<double> start_;
  EnvironmentOptions o_;
  std::vector<int> driven_, observed_;
  std::uint64_t seed_;
  std::unique_ptr<phs::System<double>> plant_;  ///< for observing
  integrators::TurnKeeper<double> keeper_;      ///< of its turns
  std::vector<double> e_, y_;
  std::vector<std::unique_ptr<LaneTeam>> teams_;
  std::vector<phs::State> states_;
  std::vector<double> actions_, observations_, final_, energies_;
  std::vector<std::uint8_t> terminated_, truncated_, failed_;
  std::vector<std::int64_t> lengths_, episodes_;
};

}  // namespace porthos::ensemble
