#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "scene/ensemble/case_checks.h"
#include "scene/ensemble/case_log.h"
#include "scene/ensemble/ensemble_scene.h"
#include "scene/run/run_report.h"

/// Ensembles: the runs of a scene's [ensemble], by one process, by parts of a job array, or by the
/// ranks of MPI.
///
/// A case is identified by its index alone, and its results do not depend on who runs it, when, or
/// with which other cases. Finished cases go to a log of each process, out/parts/K_of_N.bin; when
/// none is missing they become ensemble.h5, in the order of their index.
namespace porthos::scene {

/// A scene with its ensemble, ready to be run. Immutable; shared by threads.
class Ensemble {
 public:
  /// @throws InvalidArgument as assemble and read_ensemble
  explicit Ensemble(Scene scene);
  Ensemble(const Ensemble&) = delete;

  const Scene& scene() const { return scene_; }
  const Assembly& assembly() const { return assembly_; }
  const EnsembleScene& cases() const { return cases_; }
  const CaseSampler& sampler() const { return sampler_; }
  const StateColumns& state_columns() const { return state_columns_; }
  const CaseLayout& layout() const { return layout_; }
  const CaseChecks& checks() const { return checks_; }
  /// Whether all cases share one model: they differ in their start alone.
  bool one_model() const { return one_model_; }
  /// Whether the cases may share SIMD lanes. The others are run as by `porthos run`, one per
  /// thread.
  bool in_lanes() const { return in_lanes_; }
  /// What must agree for a log of cases to be continued, or to be joined.
  NamedTexts identity() const;

  struct WorkOptions {
    int threads = 0;    ///< 0: as many as the machine has
    bool lanes = true;  ///< off: a control
    const std::atomic<bool>* stop = nullptr;
  };
  /// Runs cases: next() gives their indices (-1: none left), done(row) receives their results. Each
  /// is called by one thread at a time, but not always by the same.
  void work(const std::function<std::int64_t()>& next,
            const std::function<void(std::span<const double>)>& done,
            const WorkOptions& options) const;

 private:
  void work_alone(const std::function<std::int64_t()>& next,
                  const std::function<void(std::span<const double>)>& done,
                  const WorkOptions& options) const;
  Scene scene_;
  Assembly assembly_;
  EnsembleScene cases_;
  CaseSampler sampler_;
  StateColumns state_columns_;
  CaseLayout layout_;
  CaseChecks checks_;
  bool one_model_, in_lanes_;
};

/// Part k of n, from 1: the cases whose index has the remainder k - 1 when divided by n.
struct Part {
  std::int64_t k = 1, n = 1;
  bool has(std::int64_t index) const { return index % n == k - 1; }
  bool whole() const { return n == 1; }
};
/// "2/8". @throws InvalidArgument "--part: ..." if it is none
Part part_of(const std::string& text);

/// The finished cases of an ensemble, in out/parts.
class CaseStore {
 public:
  /// Reads every log in the folder, and appends to the log of `part`.
  /// @throws InvalidArgument for a log of another ensemble, one that is in use, or, without
  /// `resume`, one of this part
  CaseStore(const Ensemble& ensemble, const std::filesystem::path& out, Part part, bool resume);

  void add(std::span<const double> row);
  bool has(std::int64_t index) const { return place_[size_t(index)].log >= 0; }
  /// The first unfinished case of the part, from `from` on; -1: none.
  std::int64_t missing(std::int64_t from) const;
  std::int64_t done() const { return done_; }        ///< of all cases
  std::int64_t of_part() const { return of_part_; }  ///< how many cases the part has
  std::int64_t part_done() const { return part_done_; }
  void read(std::int64_t index, std::span<double> row) const;
  void sync() { own_->sync(); }
  /// What was damaged in the logs, in one sentence; "" if nothing was.
  std::string damage() const;
  /// Throws InvalidArgument naming the first missing cases, if any.
  void require_complete() const;
  /// Closes and removes the logs. @returns as remove_unneeded()
  std::string remove();

 private:
  struct Where {
    int log = -1;
    CaseLog::Place place = 0;
  };
  void take_in(int log);
  const Ensemble& ensemble_;
  std::filesystem::path folder_;
  Part part_;
  std::vector<std::unique_ptr<CaseLog>> logs_;
  CaseLog* own_ = nullptr;
  std::vector<Where> place_;
  std::int64_t done_ = 0, of_part_ = 0, part_done_ = 0;
};

/// Smallest, 5 %, 25 %, median, 75 %, 95 %, largest: of the finite values, by the nearest rank.
inline constexpr double quantile_levels[] = {0, 0.05, 0.25, 0.5, 0.75, 0.95, 1};
struct Spread {
  double quantiles[std::size(quantile_levels)] = {};
  std::int64_t worst = -1;  ///< the case with the largest
};

/// Whether numbers from least to largest are the same but for rounding.
inline bool same_in_every_case(double least, double largest) {
  return largest - least <= 1e-12 * std::max(std::abs(least), std::abs(largest));
}

/// Statistics of an event over the cases.
struct EventSpread {
  std::string name;
  std::int64_t happened = 0;  ///< number of cases
  Spread time;                ///< of those [s]
};

/// A number of an [[output]] over the cases: at the end, and its extremes at the records.
struct OutputSpread {
  std::string name, unit;
  Spread end, least, largest;
};

/// A requirement over the cases, and the number that is furthest on its wrong side, at the records.
struct RequirementWorst {
  std::string check, output, unit;  ///< "stop.too fast", the number it limits, of which unit
  double limit = 0;
  bool above = true;  ///< fails above the limit, the worst is the largest; else the least
  double value = 0;
  std::int64_t of_case = -1;
};

/// "3.2 rad/s", of a number without a unit itself.
std::string with_unit(const std::string& number, const std::string& unit);
/// The limit of a check, so that people can read it: "2e-13", "at most 3 rad/s"; "": not known.
std::string limit_text(const Ensemble& ensemble, const std::string& check);

/// A kind of trouble: in how many cases, and the first of them.
struct CaseKind {
  static constexpr size_t most_named = 8;
  std::string name;
  std::int64_t count = 0;
  std::vector<std::int64_t> first = {};
};
/// The one with a name; null: there is none.
const CaseKind* find_kind(const std::vector<CaseKind>& kinds, const std::string& name);

/// How the cases of an ensemble ended.
struct EnsembleReport {
  std::int64_t cases = 0, done = 0, passed = 0;
  std::int64_t not_judged = 0;          ///< none of their checks is telling
  std::vector<CaseKind> failures;       ///< did not reach their end, by reason
  std::vector<CaseKind> failed_checks;  ///< checks that did not hold
  /// Requirements that were not judged: never looked at, or the case did not reach its end.
  std::vector<CaseKind> not_judged_checks;
  Spread energy, linear, angular;   ///< of the others: relative errors, maxima over the run
  std::vector<EventSpread> events;  ///< in the order of the scene, over all cases
  std::vector<OutputSpread> outputs;
  std::vector<RequirementWorst> requirements;  ///< without those that begin after the start
  std::vector<std::int64_t> stopped;           ///< cases that each stop ended
  std::vector<std::int64_t> not_passed;        ///< the first ten
  bool interrupted = false, complete = false;  ///< complete: the results are written
  double wall_s = 0;
  std::int64_t run_here = 0;   ///< cases this process (and its ranks) ran
  std::string damage = {};     ///< of the logs, in one sentence; not written into ensemble.json
  std::string left_over = {};  ///< as remove_unneeded(); likewise
  Verdict verdict() const {
    return passed == cases                ? Verdict::pass
           : passed + not_judged == cases ? Verdict::not_judged
                                          : Verdict::fail;
  }
};

/// Selects which cases are run, where, and how.
struct EnsembleOptions {
  std::string out = "results";
  Part part = {};
  bool resume = false;
  bool join = false;  ///< run nothing, join the results of the parts
  int threads = 0;
  bool lanes = true;
  const std::atomic<bool>* stop = nullptr;
  /// Fraction done, wall seconds spent, estimated wall seconds left.
  std::function<void(double, double, double)> progress = {};
};

/// Progress of a store, at most four times a second.
class CaseProgress {
 public:
  CaseProgress(const CaseStore& store, const EnsembleOptions& options);
  void report_progress();
  double spent() const;

 private:
  const CaseStore& store_;
  const EnsembleOptions& options_;
  std::int64_t before_;
  double start_, last_ = 0;
};

/// Runs the missing cases. When the ensemble is complete, writes ensemble.h5, ensemble.json and
/// ensemble.svg: the same bytes for any number of threads, parts, ranks and interruptions.
/// @throws InvalidArgument as Ensemble and CaseStore
EnsembleReport run_ensemble(const Ensemble& ensemble, const EnsembleOptions& options);

/// Writes the results if every case is finished, and then removes the logs.
EnsembleReport finish_ensemble(const Ensemble& ensemble, CaseStore& store,
                               const EnsembleOptions& options);

/// What the finished cases of a store show. Cost: reads each row once.
EnsembleReport report_on(const Ensemble& ensemble, const CaseStore& store);

/// ensemble.h5, ensemble.json and ensemble.svg.
void write_ensemble(const std::filesystem::path& folder, const Ensemble& ensemble,
                    const CaseStore& store, const EnsembleReport& report);
/// ensemble.json.
std::string ensemble_json(const Ensemble& ensemble, const CaseStore& store,
                          const EnsembleReport& report);

}  // namespace porthos::scene
