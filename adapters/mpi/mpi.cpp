#include "adapters/mpi/mpi.h"

#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <exception>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace porthos::adapters {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using scene::Ensemble, scene::EnsembleOptions, scene::EnsembleReport;

enum Tag { ask = 1, give, result, beat };
/// Answers to `ask` besides cases.
enum Word : std::int64_t { wait = -1, stop = -2, stop_without_farewell = -3 };

constexpr auto beat_every = 1s;
constexpr auto given_up_after = 10s;  // a rank, by rank 0
constexpr auto look_every = 500us;
constexpr auto left_alone_after = 60s;  // rank 0, which answers at once, by a rank
constexpr size_t most_at_once = 64;

/// What rank 0 knows: the queue of cases and who has which. Used by its own threads and the one
/// that speaks to the ranks.
class CaseScheduler {
 public:
  CaseScheduler(const Ensemble& e, const EnsembleOptions& o, int ranks)
      : store_(e, o.out, o.part, o.resume),
        progress_(store_, o),
        before_(store_.part_done()),
        stop_(o.stop),
        at_(size_t(ranks), Clock::now()),
        has_(size_t(ranks)),
        gone_(size_t(ranks)) {}

  scene::CaseStore& store() { return store_; }
  double spent() const { return progress_.spent(); }
  std::int64_t run() const { return store_.part_done() - before_; }

  std::int64_t next(int rank) {
    const std::lock_guard lock(mutex_);
    return next_of(rank);
  }
  void done(int rank, std::span<const double> row, size_t index_at) {
    const std::lock_guard lock(mutex_);
    has_[size_t(rank)].erase(scene::integer(row[index_at]));
    store_.add(row);
    progress_.report_progress();
    if (progress_.spent() - synced_ > 5) {
      store_.sync();
      synced_ = progress_.spent();
    }
  }
  /// Cases for a rank that asks, or a word.
  std::vector<std::int64_t> cases_for(int rank) {
    const std::lock_guard lock(mutex_);
    std::vector<std::int64_t> list;
    if (ended()) {
      gone_[size_t(rank)] = true;
      return {lost_ ? stop_without_farewell : stop};
    }
    // Few at a time near the end, so that all come to it together.
    const auto left = size_t(store_.of_part() - store_.part_done());
    const size_t most = std::clamp<size_t>(left / (8 * at_.size()), 1, most_at_once);
    for (std::int64_t i; list.size() < most && (i = next_of(rank)) >= 0;) list.push_back(i);
    if (list.empty()) list.push_back(wait);
    return list;
  }

  void heartbeat(int rank) { at_[size_t(rank)] = Clock::now(); }
  void hear_all() { std::fill(at_.begin(), at_.end(), Clock::now()); }
  /// Gives up ranks that are silent; what they had goes back.
  void check_heartbeats() {
    const std::lock_guard lock(mutex_);
    for (size_t r = 1; r < at_.size(); ++r) {
      if (gone_[r] || Clock::now() - at_[r] < given_up_after) continue;
      fmt::print(stderr,
                 "porthos: rank {} has not been heard of for {} s: its {} cases are done again\n",
                 r, std::chrono::seconds(given_up_after).count(), has_[r].size());
      for (const auto i : has_[r])
        if (!store_.has(i)) back_.push_back(i);
      has_[r].clear();
      gone_[r] = lost_ = true;
    }
  }
  bool lost() const { return lost_; }
  bool all_gone() const {
    return std::all_of(gone_.begin() + 1, gone_.end(), [](bool g) { return g; });
  }
  bool over() {
    const std::lock_guard lock(mutex_);
    return ended();
  }

 private:
  bool ended() const {
    return store_.part_done() == store_.of_part() ||
           (stop_ && stop_->load(std::memory_order_relaxed));
  }
  std::int64_t next_of(int rank) {
    std::int64_t i = -1;
    if (!back_.empty()) {
      i = back_.front();
      back_.pop_front();
    } else if (from_ >= 0) {
      i = store_.missing(from_);
      from_ = i < 0 ? -1 : i + 1;
    }
    if (i >= 0) has_[size_t(rank)].insert(i);
    return i;
  }

  std::mutex mutex_;
  scene::CaseStore store_;
  scene::CaseProgress progress_;
  std::int64_t before_, from_ = 0;
  double synced_ = 0;
  const std::atomic<bool>* stop_;
  std::deque<std::int64_t> back_;            ///< of ranks that were given up
  std::vector<Clock::time_point> at_;        ///< when each rank was last heard of
  std::vector<std::set<std::int64_t>> has_;  ///< cases each rank is at
  std::vector<bool> gone_;                   ///< told to stop, or given up
  bool lost_ = false;
};

/// Answers one message, if there is one.
bool answer_one(CaseScheduler& scheduler, const scene::CaseLayout& layout) {
  int there = 0;
  MPI_Status s;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &s);
  if (!there) return false;
  const int from = s.MPI_SOURCE;
  scheduler.heartbeat(from);
  if (s.MPI_TAG == result) {
    std::vector<double> row(layout.size());
    MPI_Recv(row.data(), int(row.size() * sizeof(double)), MPI_BYTE, from, result, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    if (layout.sound(row)) scheduler.done(from, row, layout.index);
    return true;
  }
  char nothing;
  MPI_Recv(&nothing, 0, MPI_BYTE, from, s.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  if (s.MPI_TAG == ask) {
    const auto list = scheduler.cases_for(from);
    MPI_Send(list.data(), int(list.size()), MPI_INT64_T, from, give, MPI_COMM_WORLD);
  }
  return true;
}

/// Tells the ranks to stop, each when it asks.
void dismiss(int ranks) {
  for (int left = ranks - 1; left > 0;) {
    MPI_Status s;
    MPI_Recv(nullptr, 0, MPI_BYTE, MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &s);
    if (s.MPI_TAG != ask) continue;
    const std::int64_t word = stop;
    MPI_Send(&word, 1, MPI_INT64_T, s.MPI_SOURCE, give, MPI_COMM_WORLD);
    --left;
  }
}

EnsembleReport lead(const MpiRank& rank, const Ensemble& ensemble, const EnsembleOptions& o) {
  const auto& layout = ensemble.layout();
  std::optional<CaseScheduler> opened;
  try {
    opened.emplace(ensemble, o, rank.size());
  } catch (const InvalidArgument&) {
    dismiss(rank.size());
    throw;
  }
  CaseScheduler& scheduler = *opened;
  std::exception_ptr trouble;
  std::atomic<bool> resting{false};
  std::thread own([&] {
    try {
      while (!scheduler.over()) {
        ensemble.work([&] { return scheduler.next(0); },
                      [&](std::span<const double> row) { scheduler.done(0, row, layout.index); },
                      {.threads = o.threads, .lanes = o.lanes, .stop = o.stop});
        std::this_thread::sleep_for(20ms);  // a rank may be given up yet
      }
    } catch (...) {
      trouble = std::current_exception();
    }
    resting = true;
  });
  auto looked = Clock::now();
  while (!(resting && (scheduler.over() || trouble) && scheduler.all_gone())) {
    if (!answer_one(scheduler, layout)) std::this_thread::sleep_for(look_every);
    if (const auto since = Clock::now() - looked; since > 1s) {
      if (since > given_up_after / 2)
        scheduler.hear_all();  // this rank stood still itself: the others' messages are yet to come
      else
        scheduler.check_heartbeats();
      looked = Clock::now();
    }
  }
  own.join();
  if (scheduler.lost()) rank.lost_some();
  if (trouble) std::rethrow_exception(trouble);
  scene::CaseStore& store = scheduler.store();
  store.sync();
  const double wall = scheduler.spent();
  const std::int64_t run = scheduler.run();
  EnsembleReport r = scene::finish_ensemble(ensemble, store, o);
  r.wall_s = wall;
  r.run_here = run;
  r.interrupted = store.part_done() < store.of_part() && !r.complete;
  return r;
}

/// What a rank says to rank 0. A rank that stood still may find rank 0 gone; then nothing is sent
/// any more. One thread at a time.
class Leader {
 public:
  /// @return whether rank 0 takes it
  bool send(const void* data, size_t bytes, Tag tag) {
    // NOLINTBEGIN(clang-analyzer-optin.mpi.MPI-Checker): MPI_Test ends it, or the process ends
    MPI_Request request;
    if (lost_ ||
        MPI_Isend(data, int(bytes), MPI_BYTE, 0, tag, MPI_COMM_WORLD, &request) != MPI_SUCCESS)
      return false;
    return happens([&](int* sent) { return MPI_Test(&request, sent, MPI_STATUS_IGNORE); });
    // NOLINTEND(clang-analyzer-optin.mpi.MPI-Checker)
  }
  bool answers() {
    return happens(
        [](int* there) { return MPI_Iprobe(0, give, MPI_COMM_WORLD, there, MPI_STATUS_IGNORE); });
  }
  bool lost() const { return lost_; }

 private:
  /// Tries again and again; time in which this rank is stopped does not count.
  template <class Try>
  bool happens(Try once) {
    for (int tries = 0; !lost_; ++tries) {
      int done = 0;
      if (once(&done) == MPI_SUCCESS && done) return true;
      lost_ = tries > left_alone_after / look_every;
      if (tries > 10) std::this_thread::sleep_for(look_every);
    }
    return false;
  }
  std::atomic<bool> lost_{false};
};

void follow(const MpiRank& rank, const Ensemble& ensemble, const EnsembleOptions& o) {
  std::mutex mutex;  // one thread at a time speaks
  std::deque<std::int64_t> mine;
  bool ended = false;
  std::atomic<bool> home{false};
  Leader leader;
  std::thread heart([&] {
    for (auto last = Clock::now(); !home; std::this_thread::sleep_for(50ms)) {
      if (Clock::now() - last < beat_every) continue;
      const std::lock_guard lock(mutex);
      leader.send(nullptr, 0, beat);
      last = Clock::now();
    }
  });
  const auto next = [&]() -> std::int64_t {
    if (mine.empty() && !ended) {
      const std::lock_guard lock(mutex);
      if (!leader.send(nullptr, 0, ask) || !leader.answers()) {
        ended = true;
        return -1;
      }
      std::vector<std::int64_t> list(most_at_once);
      MPI_Status s;
      MPI_Recv(list.data(), int(list.size()), MPI_INT64_T, 0, give, MPI_COMM_WORLD, &s);
      int count = 0;
      MPI_Get_count(&s, MPI_INT64_T, &count);
      list.resize(size_t(count));
      if (list[0] == stop_without_farewell) rank.lost_some();
      if (list[0] == stop || list[0] == stop_without_farewell) ended = true;
      if (list[0] >= 0) mine.assign(list.begin(), list.end());
    }
    if (mine.empty()) return -1;
    const std::int64_t i = mine.front();
    mine.pop_front();
    return i;
  };
  const auto done = [&](std::span<const double> row) {
    const std::lock_guard lock(mutex);
    leader.send(row.data(), row.size_bytes(), result);
    if (leader.lost()) mine.clear();
  };
  std::exception_ptr trouble;
  while (!ended && !trouble) try {
      ensemble.work(next, done, {.threads = o.threads, .lanes = o.lanes, .stop = o.stop});
      if (!ended) std::this_thread::sleep_for(50ms);
      if (o.stop && o.stop->load()) {  // hears that it may stop
        mine.clear();
        (void)next();
      }
    } catch (...) {
      trouble = std::current_exception();
    }
  home = true;
  heart.join();
  if (leader.lost()) rank.lost_some();
  if (trouble) {
    rank.lost_some();
    std::rethrow_exception(trouble);
  }
}

}  // namespace

MpiRank::MpiRank() {
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
  if (provided < MPI_THREAD_SERIALIZED)
    throw InvalidArgument("this MPI library lets one thread use it, expected any thread in turn");
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
}

MpiRank::~MpiRank() {
  if (!lost_) {
    MPI_Finalize();
    return;
  }
  std::fflush(nullptr);
  _exit(0);
}

std::optional<EnsembleReport> run_ensemble(const MpiRank& rank, const Ensemble& ensemble,
                                           const EnsembleOptions& o) {
  if (o.join || rank.size() == 1)
    return rank.rank() == 0 ? std::optional(scene::run_ensemble(ensemble, o)) : std::nullopt;
  if (rank.rank() == 0) return lead(rank, ensemble, o);
  follow(rank, ensemble, o);
  return std::nullopt;
}

}  // namespace porthos::adapters
