#include "scene/sensitivity/end_differences.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>

#include "ensemble/batch.h"
#include "phs/nearest.h"
#include "scene/compare/auto_method.h"
#include "scene/sensitivity/end_quantities.h"
#include "scene/sensitivity/ridders.h"
#include "scene/sensitivity/unknowns.h"
#include "scene/session/memory_run.h"

namespace porthos::scene {
namespace {

constexpr int runs_of_input = 24;      // ridders.h
constexpr double first_change = 0.02;  // of a whole change
// Of a number at the end, relative: what the roundings of some thousand steps add up to.
constexpr double rounding_of_run = 1e-13;
constexpr double doubtful = 0.01;  // error of a slope, relative: told
constexpr size_t most_told = 3;

/// What an output was over the run.
struct Extreme {
  const char* suffix;
  double OutputRow::*number;
};
constexpr Extreme extremes[] = {
    {"", &OutputRow::end}, {".least", &OutputRow::least}, {".largest", &OutputRow::largest}};

/// A run of the scene or of a neighbour of it, as the numbers that are asked about.
class EndOfRun {
 public:
  EndOfRun(const Scene& scene, const Assembly& assembly, const std::vector<std::string>& names) {
    const auto outputs = number_names(scene.outputs);
    const EndQuantities motion(scene, assembly);
    std::vector<std::string> all;
    for (const auto& name : outputs)
      for (const Extreme& e : extremes) all.push_back(name + e.suffix);
    of_outputs_ = all.size();
    if (!scene.orbit)
      for (const auto& name : motion.known())
        if (std::ranges::find(all, name) == all.end()) all.push_back(name);
    if (all.empty())
      throw InvalidArgument(in_file(scene.path) +
                            "there is nothing to ask about the end of the run, expected an "
                            "[[output]]");
    names_ = !names.empty() ? names : !outputs.empty() ? outputs : motion.usual();
    const Names known(all.begin(), all.end());
    for (const auto& name : names_) {
      const auto at = size_t(std::ranges::find(all, name) - all.begin());
      if (at == all.size())
        throw InvalidArgument(
            fmt::format("{}there is no '{}' at the end of a run, the nearest is '{}'",
                        in_file(scene.path), name, nearest(name, known)));
      places_.push_back(at);
      if (at >= of_outputs_) of_motion_.push_back(name);
    }
  }

  const std::vector<std::string>& names() const { return names_; }

  /// The numbers of a run of the scene; NaN of one that fails, and why.
  std::vector<double> of(const Scene& scene, const std::atomic<bool>* stop, std::string& why,
                         std::vector<std::string>* units = nullptr) const {
    std::vector<double> numbers(names_.size(), NAN);
    try {
      const Assembly a = assemble(scene);
      const MemoryOptions options{.stop = stop, .judge = false};
      if (scene.events.empty()) {
        fill(scene, a, run_in_memory(scene, a, options), numbers, why, units);
      } else {
        PhaseSequence phases(scene, a);
        const RunReport r = run_in_memory(phases, options);
        fill(scene, phases.last(), r, numbers, why, units);
      }
    } catch (const InvalidArgument& e) {  // a number that a reader or an event refuses
      why = e.what();
    }
    return numbers;
  }

 private:
  void fill(const Scene& scene, const Assembly& a, const RunReport& r, std::vector<double>& numbers,
            std::string& why, std::vector<std::string>* units) const {
    if (r.interrupted) return;
    if (r.outcome != integrators::Outcome::ok || !r.trouble.empty()) {
      why = fmt::format("the run ended at t = {:.6g} s: {}", r.simulated_s,
                        r.trouble.empty() ? to_string(r.outcome) : r.trouble);
      return;
    }
    std::vector<EndQuantity> motion;
    if (!of_motion_.empty())
      motion = EndQuantities(scene, a).at(r.simulated_s, r.final_state, of_motion_, {});
    auto next = motion.begin();
    for (size_t i = 0; i < names_.size(); ++i) {
      const size_t at = places_[i], kinds = std::size(extremes);
      if (at < of_outputs_) {
        const OutputRow& row = r.outputs.at(at / kinds);
        numbers[i] = row.*extremes[at % kinds].number;
        if (units) units->push_back(row.unit);
      } else {
        numbers[i] = next->value;
        if (units) units->push_back(next->unit);
        ++next;
      }
    }
  }

  std::vector<std::string> names_, of_motion_;
  std::vector<size_t> places_;  ///< of the names: first the outputs, each with its extremes
  size_t of_outputs_ = 0;
};

/// A body's name is all ten numbers of it.
std::vector<std::string> each_number(const std::vector<std::string>& by, const Assembly& a) {
  std::vector<std::string> names;
  for (const auto& name : by)
    if (std::ranges::find(a.parts.bodies(), name, &mechanics::BodySpec::name) ==
        a.parts.bodies().end())
      names.push_back(name);
    else
      for (const char* number : inertial_numbers) names.push_back(name + "." + number);
  return names;
}

/// The runs beside the nominal one, as ridders() asks for them: first up, then down, ever nearer.
class Neighbours {
 public:
  explicit Neighbours(const std::vector<double>& nominal) : nominal_(nominal) {}
  std::span<const double> add(double d, std::vector<double> numbers) {
    runs_.push_back({std::fabs(d), std::move(numbers)});
    return runs_.back().numbers;
  }
  /// How far the slopes of both sides are apart, of a number whose difference does not shrink with
  /// the distance as that of a smooth one does, and is no rounding: half of it is the error of a
  /// central difference, which does not see it. Else 0.
  double kink(size_t k, double rounding) const {
    double far = 0, least = HUGE_VAL;
    int seen = 0;
    for (size_t i = 0; i + 1 < runs_.size(); i += 2) {
      const double d = runs_[i].distance,
                   apart =
                       std::fabs(runs_[i].numbers[k] + runs_[i + 1].numbers[k] - 2 * nominal_[k]) /
                       d;
      if (!std::isfinite(apart)) continue;
      if (i < 6) far = std::max(far, apart);  // within the first eighth of the change
      if (!(apart > 8 * rounding / d)) continue;
      least = std::min(least, apart);
      ++seen;
    }
    return seen > 3 && least > 0.5 * far ? least : 0;  // of a smooth one it shrank to an eighth
  }

 private:
  struct Run {
    double distance;
    std::vector<double> numbers;
  };
  const std::vector<double>& nominal_;
  std::vector<Run> runs_;
};

/// "a; b; c; and 4 more"
std::string first_of(std::vector<std::string> list) {
  const size_t more = list.size() - std::min(most_told, list.size());
  list.resize(list.size() - more);
  if (more > 0) list.push_back(fmt::format("and {} more", more));
  return fmt::format("{}", fmt::join(list, "; "));
}

/// Slopes that are none, and those that are known badly. large: errors by quantity and input that
/// are no rounding.
void add_notes(EndSensitivity& r, const std::vector<std::string>& why,
               const std::function<bool(size_t of, size_t input)>& large) {
  std::vector<std::string> uncertain, none;
  for (size_t k = 0; k < r.of.size(); ++k)
    for (size_t i = 0; i < r.inputs.size(); ++i) {
      const EndSlopes& q = r.of[k];
      const std::string which = fmt::format("{} by {}", q.name, r.inputs[i].name);
      if (!std::isfinite(q.slopes[i]))
        none.push_back("no slope of " + which + (why[i].empty() ? "" : ": beside it " + why[i]));
      else if (q.errors[i] > doubtful * std::fabs(q.slopes[i]) && (q.counts(i) || large(k, i)))
        uncertain.push_back(fmt::format("{}, {:.2g} to {:.1g}", which, q.slopes[i], q.errors[i]));
    }
  if (!none.empty()) r.notes.push_back(first_of(none));
  if (!uncertain.empty())
    r.notes.push_back("slopes known to worse than one percent: " + first_of(uncertain) +
                      ". A law or an event jumps there or has a kink, or the run is chaotic");
}

}  // namespace

EndSensitivity end_differences(const Scene& given, const SensitivityRequest& request) {
  Scene scene = given;
  scene.centre_stays = !scene.orbit;  // its end is then that of the world
  const Assembly a = assemble(scene);
  scene = with_method_chosen(scene, a);
  if (!scene.events.empty()) (void)rehearse(scene, a);
  const Unknowns unknowns(scene, a, each_number(request.by, a), NumbersOf::run);
  const EndOfRun end(scene, a, request.of);

  EndSensitivity r;
  r.title = scene.title;
  r.method = scene.method;
  r.step = scene.step;
  r.duration = scene.duration;
  r.uncertainty = request.uncertainty;
  r.runs = 1 + std::int64_t(unknowns.size()) * runs_of_input;
  for (const Unknown& u : unknowns.list())
    r.inputs.push_back({u.name, u.unit, u.start, u.of_start});

  std::vector<std::string> units;
  const auto values = end.of(scene, request.stop, r.failure, &units);
  if (request.stop && request.stop->load()) r.failure = "interrupted";
  if (!r.failure.empty()) return r;

  std::vector<Differences> by(unknowns.size());
  std::vector<std::string> why(unknowns.size());
  std::mutex telling;
  std::int64_t done = 1;
  const auto tell = [&] {
    const std::lock_guard lock(telling);
    ++done;
    if (request.progress) request.progress(double(done) / double(r.runs));
  };
  // Of numbers like it: one of them that is zero has their rounding.
  std::vector<double> rounding(values.size());
  for (size_t k = 0; k < values.size(); ++k)
    for (size_t l = 0; l < values.size(); ++l)
      if (units[l] == units[k])
        rounding[k] = std::max(rounding[k], rounding_of_run * std::fabs(values[l]));
  ensemble::in_parallel(request.threads, int(unknowns.size()), [&](int i) {
    Neighbours beside(values);
    const auto run = [&](double d) {
      auto z = unknowns.start();
      z[size_t(i)] += d;
      Scene s = unknowns.at(z);
      s.centre_stays = scene.centre_stays;
      s.choice = scene.choice;
      const auto numbers = beside.add(d, end.of(s, request.stop, why[size_t(i)]));
      tell();
      return numbers;
    };
    Differences found = ridders(run, values.size(), first_change, rounding_of_run);
    for (size_t k = 0; k < values.size(); ++k)
      found.error[k] = std::max({found.error[k], rounding[k], beside.kink(k, rounding[k]) / 2});
    by[size_t(i)] = std::move(found);
  });
  if (request.stop && request.stop->load()) {
    r.failure = "interrupted";
    return r;
  }
  for (size_t k = 0; k < values.size(); ++k) {
    EndSlopes q{end.names()[k], units[k], values[k] + 0.0, {}, NAN, 0};
    for (size_t i = 0; i < unknowns.size(); ++i) {
      q.slopes.push_back(by[i].slope[k] / unknowns.by_z(i));
      q.errors.push_back(by[i].error[k] / std::fabs(unknowns.by_z(i)));
    }
    r.of.push_back(std::move(q));
  }
  add_notes(r, why, [&](size_t k, size_t i) {
    return rounding[k] > 0 && by[i].error[k] > 1e7 * rounding[k];  // a millionth of the number
  });
  return r;
}

}  // namespace porthos::scene
