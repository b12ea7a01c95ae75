#include "ensemble/batch.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <vector>

#include "ensemble/lane_team.h"

// The thread sanitizer does not see the synchronisation inside Debian's oneTBB. Under it the tasks
// run in separate threads.
#ifdef __has_feature
#if __has_feature(thread_sanitizer)
#define PORTHOS_THREAD_SANITIZER
#endif
#endif

namespace porthos::ensemble {

int threads_of(int threads) {
  return threads > 0 ? threads : std::max(1, oneapi::tbb::info::default_concurrency());
}

void in_parallel(int threads, int count, const std::function<void(int)>& work) {
  const int n = std::min(threads_of(threads), count);
  if (n <= 1) {
    for (int i = 0; i < count; ++i) work(i);
    return;
  }
#ifdef PORTHOS_THREAD_SANITIZER
  std::vector<std::exception_ptr> thrown(static_cast<size_t>(count));
  {
    std::vector<std::jthread> team;
    for (int i = 0; i < count; ++i)
      team.emplace_back([&, i] {
        try {
          work(i);
        } catch (...) {
          thrown[size_t(i)] = std::current_exception();
        }
      });
  }
  for (const auto& t : thrown)
    if (t) std::rethrow_exception(t);
#else
  // Permits more threads than the machine has, if the caller requests them.
  const oneapi::tbb::global_control allow(oneapi::tbb::global_control::max_allowed_parallelism,
                                          size_t(std::max(n, threads_of(0))));
  oneapi::tbb::task_arena arena(n);
  arena.execute(
      [&] { oneapi::tbb::parallel_for(0, count, work, oneapi::tbb::simple_partitioner()); });
#endif
}

void in_team(int threads, const std::atomic<bool>* stop,
             const std::function<void(const std::function<bool()>& stopped)>& member) {
  std::atomic<bool> failed{false};
  const std::function<bool()> stopped = [&] {
    return failed.load(std::memory_order_relaxed) ||
           (stop && stop->load(std::memory_order_relaxed));
  };
  const int n = threads_of(threads);
  in_parallel(n, n, [&](int) {
    try {
      member(stopped);
    } catch (...) {
      failed = true;
      throw;
    }
  });
}

void simulate_batch(const phs::Model& model, const std::string& method, double step,
                    const Source& source, const BatchOptions& o) {
  std::mutex one_at_a_time;
  in_team(o.threads, o.stop, [&](const std::function<bool()>& stopped) {
    const Source next = [&]() -> std::unique_ptr<BatchRun> {
      const std::lock_guard lock(one_at_a_time);
      return stopped() ? nullptr : source();
    };
    LaneTeam(model, method, step, o.method, o.lanes).work(next, stopped);
  });
}

namespace {

class Kept final : public BatchRun {
 public:
  explicit Kept(BatchResult& to) : to_(to) {}
  void end(const phs::State& last, integrators::Outcome outcome) override { to_ = {last, outcome}; }

 private:
  BatchResult& to_;
};

}  // namespace

std::vector<BatchResult> simulate_batch(const phs::Model& model, const std::string& method,
                                        double step, std::int64_t steps,
                                        std::span<const std::vector<double>> starts,
                                        const BatchOptions& o) {
  BatchOptions options = o;
  options.method.port_work = false;
  std::vector<BatchResult> results(starts.size());
  size_t at = 0;
  simulate_batch(
      model, method, step,
      [&]() -> std::unique_ptr<BatchRun> {
        if (at == starts.size()) return nullptr;
        auto run = std::make_unique<Kept>(results[at]);
        run->start = phs::State(model.description(), starts[at++]);
        run->steps = steps;
        return run;
      },
      options);
  return results;
}

}  // namespace porthos::ensemble
