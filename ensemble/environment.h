#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ensemble/random.h"
#include "integrators/core/integrator.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

namespace porthos::ensemble {

/// The number of environments and the definition of their steps.
struct EnvironmentOptions {
  int count = 1;  ///< environments side by side
  std::string method = "gauss4";
  double step = 0.01;  ///< of the method [s]
  int substeps = 1;    ///< steps for which an action is held
  std::uint64_t seed = 0;
  std::int64_t longest = 0;  ///< maximum number of actions per episode; 0: no limit
  int threads = 1;           ///< 0: as many as the machine has
  /// Names of the ports that actions drive; empty: all. The other inputs are 0.
  std::vector<std::string> ports = {};
  /// Indices of observed state numbers; empty: all.
  std::vector<int> observed = {};
  bool outputs = false;  ///< whether y of the driven ports is observed, after the state
  /// Changes the start state x of an episode (nx numbers, initially the environment's `start`),
  /// with random numbers of the episode. Quaternions are normed after it; a start off the
  /// constraints is refused.
  std::function<void(Stream& random, std::span<double> x)> begin = {};
  /// Whether the episode ends at x, by reaching or leaving a set. Called by any thread.
  std::function<bool(std::span<const double> x)> ended = {};
};

/// What an episode may begin as: a model and a start of its own.
struct EnvironmentCase {
  std::shared_ptr<const phs::Model> model;  ///< cases that share one share its lanes
  std::vector<double> start;                ///< state numbers, nx
  /// In place of that of the options; empty: that.
  std::function<bool(std::span<const double> x)> ended = {};
};

/// Environments for learning and planning: reset, act, observe, over a batch.
///
/// An action is a row of port inputs u, held over `substeps` steps. The caller computes rewards
/// from observations and actions. A step depends only on the environment's state, case and action,
/// and not on threads, lanes, neighbours or earlier steps. So planners may restore states. Random
/// numbers depend on (seed, environment, episode): the same seed and actions give the same bits. If
/// an episode ends (goal, limit of length, or failure of the method), the environment starts the
/// next episode in the same step. final_observations() then has its last observation. With several
/// cases every episode draws the one that it begins as, with its first random number.
///
/// All arrays are contiguous, with one row per environment: count × action_size() and so on. They
/// stay valid; reset() and step() overwrite them. Use from one thread.
class Environment {
 public:
  /// @param start  state numbers at the start of an episode, nx
  /// @throws InvalidArgument for unknown ports or state numbers, sizes that do not fit, a model
  ///   with sampled controllers, a start off the constraints, and as integrators::make_integrator
  Environment(std::shared_ptr<const phs::Model> model, std::vector<double> start,
              EnvironmentOptions options);
  /// Of models that differ in numbers alone. @throws InvalidArgument also for none, and for models
  ///   whose state numbers or ports differ
  Environment(std::vector<EnvironmentCase> cases, EnvironmentOptions options);
  ~Environment();

  int count() const { return o_.count; }
  int action_size() const { return int(driven_.size()); }
  int observation_size() const { return int(observed_.size() + (o_.outputs ? driven_.size() : 0)); }
  /// Seconds between actions.
  double interval() const { return o_.step * o_.substeps; }
  /// That of the first case.
  const phs::Model& model() const { return *given_[0].model; }

  /// Starts the first episode of a seed in every environment; without a seed the next one. That is
  /// the episode which the constructor or the last step began, as long as nothing has used it: so
  /// resets after ends of episodes leave out no draw.
  void reset(std::optional<std::uint64_t> seed = {});
  /// The same with a seed for each, which then begins as it would alone. @throws InvalidArgument
  /// for another number than count()
  void reset(std::span<const std::uint64_t> seeds);
  /// @param actions  count × action_size(). @throws InvalidArgument for another size or a number
  ///   that is not finite
  void step(std::span<const double> actions);
  /// Ends the episodes of these environments (count() flags) in the step just taken, and begins the
  /// next ones, where step() has not: as `ended` does, or as a failure does. One that has failed
  /// observed last what it did before the step. @throws InvalidArgument for another number of flags
  void end(std::span<const std::uint8_t> which, bool failed);

  std::span<const double> observations() const { return observations_; }
  /// For environments whose episode ended in the last step, the last observation of that episode;
  /// for the others the same as observations().
  std::span<const double> final_observations() const { return final_; }
  /// 1 if an episode ended in the last step: terminated by `ended` or a failure, truncated by its
  /// length, failed by a failure.
  std::span<const std::uint8_t> terminated() const { return terminated_; }
  std::span<const std::uint8_t> truncated() const { return truncated_; }
  std::span<const std::uint8_t> failed() const { return failed_; }
  /// How the method ended the last step; ok also where end() says that it failed.
  std::span<const integrators::Outcome> outcomes() const { return outcomes_; }
  /// H of each environment [J], and H at final_observations().
  std::span<const double> energies() const { return energies_; }
  std::span<const double> final_energies() const { return final_energies_; }
  /// The case of each environment, from 0, and that of final_observations().
  std::span<const int> cases() const { return cases_; }
  std::span<const int> final_cases() const { return final_cases_; }
  /// Number of steps in the current episode, and the number of the episode.
  std::span<const std::int64_t> lengths() const { return lengths_; }
  std::span<const std::int64_t> episodes() const { return episodes_; }

  /// What the last step() cost: iterations of the method per step of it, mean of all environments
  /// (of an explicit method 1), and how many environments left the SIMD lanes for Newton's method.
  double iterations() const { return iterations_; }
  int alone() const { return alone_; }

  /// The state of an environment. set_state() replaces it and continues the episode.
  const phs::State& state(int environment) const { return states_[size_t(environment)]; }
  void set_state(int environment, const phs::State& state);

 private:
  class Turn;
  class Plant;
  void check_options() const;
  /// Begins the next episode, observed in observations_.
  void begin(int environment);
  /// Steps every environment, those of a model in lanes.
  void advance();
  /// Writes the observation and the energy.
  void observe(int environment);
  Plant& plant_of(int environment) const;

  std::vector<EnvironmentCase> given_;
  EnvironmentOptions o_;
  int threads_ = 1;
  double iterations_ = 0;
  int alone_ = 0;
  std::vector<int> driven_, observed_;
  std::vector<std::uint64_t> seeds_, streams_;  ///< of each
  std::vector<std::unique_ptr<Plant>> plants_;  ///< one of each model
  std::vector<size_t> plant_of_case_;
  std::vector<double> e_, y_;
  std::vector<int> cases_, final_cases_;
  std::vector<phs::State> states_;
  std::vector<double> actions_, observations_, final_, energies_, final_energies_;
  std::vector<double> before_, energies_before_;  ///< of the last step
  std::vector<std::uint8_t> terminated_, truncated_, failed_;
  std::vector<std::uint8_t> unused_;  ///< began in the last step or the constructor, as drawn
  std::vector<integrators::Outcome> outcomes_;
  std::vector<std::int64_t> lengths_, episodes_;
};

}  // namespace porthos::ensemble
