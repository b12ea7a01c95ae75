#include "scene/session/run.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>

#include "scene/compare/auto_method.h"
#include "scene/files/files.h"
#include "scene/read/scene_texts.h"
#include "scene/run/checkpoint.h"
#include "scene/run/from_records.h"
#include "scene/run/pace.h"
#include "scene/run/verdict.h"
#include "scene/run/watched_run.h"
#include "scene/session/phases.h"
#include "scene/session/results.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

using integrators::Outcome;
using Clock = Pace::Clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double cpu_now() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

fs::path checkpoint_folder(const std::string& out) { return fs::path(out) / "checkpoint"; }

/// Folder of the checkpoint of a started run; of its first phase if it has several.
fs::path begun(const std::string& out) {
  for (const char* phase : {"end", "checkpoint"})
    if (const fs::path first = fs::path(out) / "phase_1" / phase; has_checkpoint(first))
      return first;
  return checkpoint_folder(out);
}

/// A checkpoint that is sound and does not belong to the scene.
struct OfAnotherRun : InvalidArgument {
  using InvalidArgument::InvalidArgument;
};

/// A run with its files: the record log, the checkpoint, the results.
class Session {
 public:
  Session(const Scene& scene, const Assembly& assembly, const RunOptions& options)
      : scene_(scene),
        assembly_(assembly),
        options_(options),
        folder_(checkpoint_folder(options.out)),
        run_(scene, assembly, options.until,
             [this](std::span<const double> row) { log_->append(row); }) {}

  RunReport run() {
    options_.resume ? resume() : start();
    try {
      loop();
    } catch (...) {  // a law or method of the user's that threw; nothing was run that could go on
      std::error_code ignored;
      if (!options_.resume && run_.steps() == 0) fs::remove_all(folder_, ignored);
      throw;
    }
    return interrupted_ ? report() : finish();
  }

 private:
  fs::path log_path() const { return folder_ / "records.bin"; }
  fs::path end_folder() const { return fs::path(options_.out) / "end"; }

  void start() {
    refuse_unfinished(options_.out);
    make_folder(folder_);
    keep_texts();
    log_ = std::make_unique<RecordLog>(log_path(), run_.layout());
    run_.begin();
    if (run_.outcome() != Outcome::ok || run_.resumable()) checkpoint();
  }

  /// Writes the input texts beside the checkpoint, so that a report can read the records of an
  /// unfinished run.
  void keep_texts() const {
    if (scene_.text.empty()) return;
    write_texts(folder_, scene_);
  }

  void resume() {
    if (!run_.resumable())
      throw InvalidArgument(fmt::format(
          "a run by {} cannot be continued from a checkpoint: start it without --resume",
          scene_.method));
    const Checkpoint c = last_sound_checkpoint();
    run_.restore(c);
    cpu_before_ = c.cpu_s;
    wall_before_ = c.wall_s;
  }

  /// Opens the log that belongs to a checkpoint.
  Checkpoint with_its_log(Checkpoint c) {
    if (const auto changes = difference(c.fingerprint, fingerprint(scene_)); !changes.empty())
      throw OfAnotherRun(
          fmt::format("the checkpoint in {} is of another run: {}", folder_.string(), changes));
    log_ = std::make_unique<RecordLog>(log_path(), run_.layout(), c.log);
    return c;
  }

  /// The last checkpoint, or the one before it if the last one or its records are damaged.
  Checkpoint last_sound_checkpoint() {
    try {
      return with_its_log(read_checkpoint(folder_));
    } catch (const OfAnotherRun&) {
      throw;
    } catch (const InvalidArgument& damage) {
      if (!has_checkpoint_before(folder_)) throw;
      Checkpoint c;
      try {
        c = with_its_log(read_checkpoint_before(folder_));
      } catch (const InvalidArgument&) {
        throw damage;
      }
      return_to_checkpoint_before(folder_);
      if (options_.say)
        options_.say(fmt::format("{}: the run continues from the checkpoint before it, at step {}",
                                 damage.what(), c.state.step));
      return c;
    }
  }

  void loop() {
    cpu_start_ = cpu_now();
    wall_start_ = Clock::now();
    first_fraction_ = run_.fraction();
    auto saved = Clock::now(), reported = saved;
    Pace pace;
    while (run_.goes_on()) {
      if (run_.steps() == options_.stop_at ||
          (options_.stop && options_.stop->load(std::memory_order_relaxed))) {
        interrupted_ = true;
        break;
      }
      run_.step();
      if (!pace.due() || run_.outcome() != Outcome::ok) continue;
      if (since(reported) > 0.25) {
        report_progress();
        reported = Clock::now();
      }
      if (since(saved) > scene_.checkpoint_every && run_.resumable()) {
        checkpoint();
        saved = Clock::now();
      }
    }
    cpu_before_ += cpu_now() - cpu_start_;
    wall_before_ += since(wall_start_);
    stopped_ = true;
    if (run_.outcome() != Outcome::ok || (interrupted_ && run_.resumable())) checkpoint();
  }

  double cpu() const { return cpu_before_ + (stopped_ ? 0 : cpu_now() - cpu_start_); }
  double wall() const { return wall_before_ + (stopped_ ? 0 : since(wall_start_)); }

  void checkpoint() { checkpoint_in(folder_); }
  void checkpoint_in(const fs::path& folder) {
    log_->sync();
    Checkpoint c;
    c.fingerprint = fingerprint(scene_);
    run_.save(c);
    c.log = log_->mark();
    c.cpu_s = cpu();
    c.wall_s = wall();
    write_checkpoint(folder, c);
  }

  void report_progress() const {
    if (!options_.progress || !run_.has_steps()) return;
    const double here = since(wall_start_), done = run_.fraction();
    const double left = here * (1 - done) / std::max(1e-300, done - first_fraction_);
    options_.progress(done, wall(), left);
  }

  RunReport report() const {
    RunReport r = run_.report();
    r.cpu_s = cpu();
    r.wall_s = wall();
    r.interrupted = interrupted_;
    run_.add_notes(r);
    if (interrupted_ && !run_.resumable())
      r.notes.push_back(fmt::format(
          "a run by {} cannot be continued from a checkpoint, none was written", scene_.method));
    return r;
  }

  RunReport finish() {
    RunReport r = report();
    log_->sync();
    FromRecords seen(scene_, assembly_, run_.layout());
    if (seen.any())
      each_record(log_path(), run_.layout(), [&](std::span<const double> row) { seen.see(row); });
    seen.fill(r);
    run_.judge(r);
    const bool more = has_more_to_judge(r, scene_, options_.check_symmetry);
    write_results(options_.out, scene_, assembly_, more ? not_yet_judged(r) : r, log_path());
    if (more) {
      judge_beside(r, scene_, assembly_, options_.check_symmetry);
      write_verdict(options_.out, scene_, assembly_, r, log_path());
    }
    if (r.outcome != Outcome::ok) return r;  // the last good state stays
    std::error_code ignored;
    if (!assembly_.is_phase) keep_end(ignored);
    if (const auto why = remove_unneeded(folder_); !why.empty() && options_.say) options_.say(why);
    return r;
  }

  /// Keeps the last state for extend_to(). One of an earlier run in the folder would not fit.
  void keep_end(std::error_code& ignored) {
    if (!run_.resumable()) {
      fs::remove_all(end_folder(), ignored);
      return;
    }
    make_folder(end_folder());
    checkpoint_in(end_folder());
  }

  /// The report written while the remaining checks are made: results, and no verdict.
  static RunReport not_yet_judged(RunReport r) {
    for (Check& c : r.checks) c.telling = false;
    r.notes.push_back("written before everything was checked: the verdict is still to come");
    return r;
  }

  const Scene& scene_;
  const Assembly& assembly_;
  const RunOptions& options_;
  const fs::path folder_;
  std::unique_ptr<RecordLog> log_;
  WatchedRun run_;
  bool interrupted_ = false, stopped_ = false;
  double first_fraction_ = 0;
  double cpu_before_ = 0, wall_before_ = 0, cpu_start_ = cpu_now();
  Clock::time_point wall_start_ = Clock::now();
};

}  // namespace

RunReport run(const Scene& scene, const Assembly& assembly, const RunOptions& options) {
  const auto go = [&](const Scene& s) {
    return s.events.empty() ? Session(s, assembly, options).run()
                            : run_phases(s, assembly, options);
  };
  if (options.resume && !has_checkpoint(begun(options.out)) &&
      fs::exists(fs::path(options.out) / "summary.json"))
    throw InvalidArgument(
        fmt::format("the run in {} is finished, expected one that was interrupted; a longer one is "
                    "--extend T (in Python extend=T)",
                    options.out));
  if (scene.method != auto_method) return go(scene);
  if (!options.resume) refuse_unfinished(options.out);  // before the pilots
  // One choice for all phases: steps are counted from time 0, by one size.
  const Scene chosen = options.resume ? with_method_of(read_checkpoint(begun(options.out)), scene)
                                      : with_method_chosen(scene, assembly);
  if (options.say) options.say(chosen.choice);
  return go(chosen);
}

}  // namespace porthos::scene
