#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

/// Many runs of one model by one method: over SIMD lanes and threads, with the bits each run has
/// alone.
namespace porthos::ensemble {

/// One run of a batch. Made when a lane is free for it and gone when it has ended, so that a batch
/// of any length needs the memory of as many runs as are at work. One thread calls its functions;
/// those of other runs are called meanwhile.
class BatchRun {
 public:
  virtual ~BatchRun() = default;

  phs::State start;              ///< where it begins
  std::int64_t steps = 0;        ///< how many it takes
  std::int64_t every = 0;        ///< steps from see() to see(); 0: at the end only
  std::int64_t look = 0;         ///< see() is called after every so many too; 0: no
  bool wants_port_work = false;  ///< whether book() is called
  std::vector<double>
      parameters;  ///< of the model (phs/system/tunable.h), for this run; empty: as they are

  /// Called first, by the thread that runs it: the place for work that others need not wait for.
  virtual void prepare() {}
  /// Energy through each of the model's powers in a step [J], after every step.
  virtual void book(std::span<const double> works) { (void)works; }
  /// After every `every` and every `look` steps and after the last. @return whether to go on
  virtual bool see(const phs::State& state) {
    (void)state;
    return true;
  }
  /// Once, at the end: the last good state, and `ok` unless a step from there failed.
  virtual void end(const phs::State& last, integrators::Outcome outcome) = 0;
};

/// Gives the next run, null when there is none left. Called by one thread at a time.
using Source = std::function<std::unique_ptr<BatchRun>()>;

/// What a batch is free to choose: no bit of a run depends on it.
struct BatchOptions {
  int threads = 0;    ///< 0: as many as the machine has
  bool lanes = true;  ///< off: one state at a time, the same bits (a control)
  integrators::Options method = {};
  const std::atomic<bool>* stop = nullptr;  ///< set: runs at work are dropped without end()
};

/// Works through all runs of a source. A lane whose run has ended, early or not, takes the next one
/// at once. Which runs share lanes and threads changes no bit of any of them. Memory: that of the
/// runs at work. Methods without lanes and models with sampled controllers (on one thread) go one
/// state at a time, as does a run from the step on whose implicit equations need Newton's
/// iteration.
/// @throws InvalidArgument as make_integrator, and for a run whose start or parameters have another
///   size than the model's; what a run's functions throw goes through after the other threads have
///   stopped
void simulate_batch(const phs::Model& model, const std::string& method, double step,
                    const Source& source, const BatchOptions& options = {});

/// How a run ended.
struct BatchResult {
  phs::State state;
  integrators::Outcome outcome = integrators::Outcome::ok;
};
/// `steps` steps from each of the states `starts` (nx numbers each), in their order.
std::vector<BatchResult> simulate_batch(const phs::Model& model, const std::string& method,
                                        double step, std::int64_t steps,
                                        std::span<const std::vector<double>> starts,
                                        const BatchOptions& options = {});

/// work(0) … work(count - 1), each once, over threads (0: as many as the machine has).
void in_parallel(int threads, int count, const std::function<void(int)>& work);
/// member(stopped) once in each of some threads (0: as many as the machine has), until all have
/// returned. stopped() is true once `stop` is set or another member has thrown; what was thrown
/// first goes through.
void in_team(int threads, const std::atomic<bool>* stop,
             const std::function<void(const std::function<bool()>& stopped)>& member);
/// What `threads` = 0 stands for.
int threads_of(int threads);

}  // namespace porthos::ensemble
