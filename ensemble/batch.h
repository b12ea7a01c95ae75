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

/// Many runs of one model by one method, over SIMD lanes and threads. Each run has the same bits as
/// alone.
namespace porthos::ensemble {

/// One run of a batch. It is created when a lane is free for it and destroyed when it has ended, so
/// a batch of any length needs the memory of the current runs only. One thread calls its functions;
/// other threads call those of other runs at the same time.
class BatchRun {
 public:
  virtual ~BatchRun() = default;

  phs::State start;              ///< start state
  std::int64_t steps = 0;        ///< number of steps
  std::int64_t every = 0;        ///< steps between calls of see(); 0: at the end only
  std::int64_t look = 0;         ///< a second interval of calls of see(); 0: none
  bool wants_port_work = false;  ///< whether book() is called
  std::vector<double>
      parameters;  ///< of the model (phs/system/tunable.h), for this run; empty: unchanged

  /// Called first, by the thread of the run: the place for work that other runs need not wait for.
  virtual void prepare() {}
  /// Energy through each of the model's powers in a step [J], after every step.
  virtual void book(std::span<const double> works) { (void)works; }
  /// After every `every` and every `look` steps, and after the last step. @return whether to
  /// continue
  virtual bool see(const phs::State& state) {
    (void)state;
    return true;
  }
  /// Called once, at the end: the last good state, and `ok` unless the step from there failed.
  virtual void end(const phs::State& last, integrators::Outcome outcome) = 0;
};

/// Returns the next run, or null if there is none. Called by one thread at a time.
using Source = std::function<std::unique_ptr<BatchRun>()>;

/// Options of a batch. No bit of a run depends on them, except through `method`.
struct BatchOptions {
  int threads = 0;    ///< 0: as many as the machine has
  bool lanes = true;  ///< off: one state at a time, the same bits (a control)
  integrators::Options method = {};
  const std::atomic<bool>* stop = nullptr;  ///< when set, current runs are dropped without end()
};

/// Executes all runs of a source. A lane whose run has ended, early or not, takes the next one at
/// once. The bits of a run do not depend on the runs that share its lanes and threads. Memory: that
/// of the current runs. Methods without lanes and models with sampled controllers (on one thread)
/// integrate one state at a time. So does a run from the step on whose implicit equations need
/// Newton's iteration.
/// @throws InvalidArgument as make_integrator, and for a run whose start or parameters do not have
///   the model's size. Exceptions from a run's functions pass through after the other threads have
///   stopped
void simulate_batch(const phs::Model& model, const std::string& method, double step,
                    const Source& source, const BatchOptions& options = {});

/// The result of a run.
struct BatchResult {
  phs::State state;
  integrators::Outcome outcome = integrators::Outcome::ok;
};
/// `steps` steps from each of the states `starts` (nx numbers each), in their order.
std::vector<BatchResult> simulate_batch(const phs::Model& model, const std::string& method,
                                        double step, std::int64_t steps,
                                        std::span<const std::vector<double>> starts,
                                        const BatchOptions& options = {});

/// Calls work(0) … work(count - 1), each once, over `threads` threads (0: as many as the machine
/// has).
void in_parallel(int threads, int count, const std::function<void(int)>& work);
/// Calls member(stopped) once in each of `threads` threads (0: as many as the machine has) and
/// waits for all. stopped() is true once `stop` is set or another member has thrown. The first
/// exception passes through.
void in_team(int threads, const std::atomic<bool>* stop,
             const std::function<void(const std::function<bool()>& stopped)>& member);
/// The number of threads, with 0 replaced by that of the machine.
int threads_of(int threads);

}  // namespace porthos::ensemble
