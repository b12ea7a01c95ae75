#include "scene/compare/auto_method.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "scene/assemble/steps.h"
#include "scene/compare/lyapunov.h"
#include "scene/compare/phase_pilot.h"
#include "scene/compare/sound_method.h"
#include "scene/compare/trial.h"
#include "scene/files/files.h"
#include "scene/run/state_distance.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

using integrators::Claim;
using integrators::Declaration;
using integrators::StepControl;

constexpr std::int64_t pilot_steps = 200;  // of the largest step
constexpr std::int64_t records = 1000;
constexpr int most_tries = 10;

// CPU seconds for pilots: after the first limit a method that was found is accepted; after the
// second it is reported that there is none; the third is for the confirmation.
constexpr double pilots_s = 1, most_pilots_s = 2, confirmation_s = 1.5;
constexpr double longer_steps = 16;  // of a step control, against the largest fixed step
constexpr double controls_s = 0.5;   // for pilots with a step control
constexpr double worth_it = 0.8;     // share of the time below which a step control is named

constexpr double late_extremes = 10;  // possible jump of the error after the longer pilot
constexpr double may_be_rounding = 1e-12;
constexpr double rounding = 1e-17;  // smaller errors cannot be required

/// A method with a step that was tried.
struct Candidate {
  Declaration method;
  double step = 0;
  StepControl control = StepControl::fixed;
  double expected = HUGE_VAL;  ///< energy error over the whole duration
  double measured = HUGE_VAL, over_s = 0;
  double cpu_s = 0;  ///< over the whole duration
  bool reaches = false;
};

class MethodChoice {
 public:
  MethodChoice(const Scene& scene, const Assembly& assembly)
      : scene_(scene), assembly_(assembly), target_(scene.target()) {}

  Scene run() {
    const double guess = scene_.step > 0 ? scene_.step : scene_.duration / 20;
    largest_step_ = find_step(assembly_, fitting_step(scene_, std::min(guess, scene_.duration)),
                              pilot_steps, scale_);
    pilot_s_ = std::min(scene_.duration, double(pilot_steps) * largest_step_);
    auto tried = pilots();
    if (tried.empty() && best_.expected < HUGE_VAL) tried.push_back(best_);  // may do better
    for (const Candidate& c : tried)
      if (auto confirmed = confirm(c)) return through_events(*confirmed);
    refuse();
  }

 private:
  const phs::Description& stepped() const { return assembly_.internal().description(); }
  /// In orbit the step is also that of the splitting, whose error is in the coupling ledger and not
  /// in the energy.
  bool coupled(const Trial& t) const {
    return !t.report.space || !(t.report.space->coupling.relative() >
                                scene_.verify.coupling.value_or(*default_limits(true).coupling));
  }

  /// The method's own weights book the works of sources and losses, so the ledger may close for a
  /// wrong motion. With sources or losses, halving the step must not move the end of a pilot by
  /// more than a thousandth, as in a verdict by step halving.
  bool resolved(const Trial& t) {
    if (stepped().powers.empty()) return true;
    Setting halved = t.setting;
    halved.step /= 2;
    const Trial half = run_trial(assembly_, halved,
                                 {.duration = t.report.simulated_s,
                                  .cpu_limit = 2 * cpu_limit(t.setting.control),
                                  .records = records,
                                  .repeat = false});
    spent_ += half.spent_s;
    if (!half.complete()) return false;
    scale_.see(t.report.final_state.x);
    const auto& d = assembly_.model->description();
    return distance(scale_, unwrapped(d, t.report.final_state),
                    unwrapped(d, half.report.final_state)) <= 1e-3;
  }

  /// The candidates that reach the target, the cheapest first.
  std::vector<Candidate> pilots() {
    std::vector<Candidate> reaching;
    // Loops that an event closes are not in the model yet.
    const char* sound = scene_.rolls()            ? "pgauss16"
                        : scene_.is_constrained() ? "spark16"
                                                  : "gauss16";
    const std::string& family = integrators::declaration_of(sound).family;
    for (const Declaration& d : integrators::catalogue()) {
      if (spent_ > (reaching.empty() ? most_pilots_s : pilots_s)) break;
      if (d.family != family || d.order < 4 || d.symplectic == Claim::fails ||
          d.energy_exact == Claim::holds || misfit(d, stepped()))
        continue;
      const Candidate c = pilot(d);
      if (c.reaches) reaching.push_back(c);
    }
    std::stable_sort(reaching.begin(), reaching.end(),
                     [](const auto& a, const auto& b) { return a.cpu_s < b.cpu_s; });
    return reaching;
  }

  /// The largest step that is expected to reach the target.
  Candidate pilot(const Declaration& d, StepControl control = StepControl::fixed) {
    double h = (control == StepControl::fixed ? 1 : longer_steps) * largest_step_,
           before = HUGE_VAL;
    for (int i = 0; i < most_tries; ++i) {
      const Candidate c = attempt(d, fitting_step(scene_, h), pilot_s_, 2, control);
      if (c.reaches || spent_ > limit_s_) return c;
      if (!(c.measured < HUGE_VAL)) {
        h /= 2;
        continue;
      }
      if (c.measured < may_be_rounding && c.measured > 0.5 * before) break;  // no step does better
      before = c.measured;
      // By the order of the method, but by no more than a factor of 1e6 in the error, and not below
      // rounding.
      const double wanted = std::max({target_ / c.expected, rounding / c.measured, 1e-6});
      h *= std::clamp(0.95 * std::pow(wanted, 1.0 / d.order), 0.1, 0.9);
    }
    return {.method = d};
  }

  /// The same method with a step control, if pilots say that it takes clearly less time. It is
  /// named, not chosen: records would leave their grid, and ensembles their lanes.
  std::optional<Candidate> with_step_control(const Candidate& c) {
    const phs::Model& model = *assembly_.model;
    if (assembly_.spacecraft || !model.description().constraints.empty() || !model.holds().empty())
      return {};
    std::optional<Candidate> best;
    for (const auto control : {StepControl::time_transformed, StepControl::reversible}) {
      limit_s_ = spent_ + controls_s;
      Candidate v = pilot(c.method, control);
      if (v.reaches && c.over_s > v.over_s)  // as the choice was confirmed
        v = attempt(v.method, v.step, c.over_s, late_extremes, control);
      if (v.reaches && v.cpu_s < (best ? best->cpu_s : worth_it * c.cpu_s)) best = v;
    }
    return best;
  }

  /// Tries the choice over a longer time, with a shorter step if the error turned out larger.
  std::optional<Candidate> confirm(Candidate c) {
    double longer = pilot_s_;
    while (longer < scene_.duration && c.cpu_s * 2 * longer < confirmation_s * scene_.duration)
      longer *= 2;
    longer = std::min(longer, scene_.duration);
    double before = HUGE_VAL;
    for (int i = 0; i < most_tries; ++i) {
      if (i > 0 && spent_ > most_pilots_s + 2 * confirmation_s) break;
      const Candidate now = attempt(c.method, c.step, longer, late_extremes, StepControl::fixed);
      if (now.reaches) return now;
      if (now.measured < may_be_rounding && now.measured > 0.5 * before) break;
      before = now.measured;
      const double shorter =
          now.expected < HUGE_VAL
              ? std::clamp(0.95 * std::pow(target_ / now.expected, 1.0 / c.method.order), 0.5, 0.95)
              : 0.5;
      c.step = fitting_step(scene_, shorter * c.step);
    }
    return {};
  }

  /// The pilots so far are of the mechanism as it starts, and events change it: the phases
  /// themselves, as far as the time for pilots goes, with a shorter step if need be.
  Scene through_events(Candidate c) {
    const auto controlled = with_step_control(c);
    Scene s = put_in(c, controlled);
    if (scene_.events.empty()) return s;
    double before = HUGE_VAL;
    for (int i = 0; i < most_tries; ++i) {
      const PhasePilot seen = pilot_phases(s, assembly_, 2 * confirmation_s);
      const bool whole = seen.until >= scene_.duration;
      if (!(seen.until > 0) || seen.error <= (whole ? 1 : 0.5) * target_ ||
          (seen.error < may_be_rounding && seen.error > 0.5 * before)) {
        s.choice += seen.until > 0 ? fmt::format("; with its events {:.1e} up to {:g} s",
                                                 seen.error, seen.until)
                                   : "; its events were not tried";
        return s;
      }
      before = seen.error;
      c.step = fitting_step(
          scene_,
          c.step * (std::isfinite(seen.error)
                        ? std::clamp(0.9 * std::pow(target_ / seen.error, 1.0 / c.method.order),
                                     0.1, 0.9)
                        : 0.5));
      s = put_in(c, controlled);
    }
    return s;
  }

  Candidate attempt(const Declaration& d, double h, double duration, double safety,
                    StepControl control) {
    Setting setting{.method = d.name, .step = h, .control = control};
    if (control != StepControl::fixed) {
      setting.control_rate = control_rate();
      setting.instants = switches_and(scene_, {duration});
    }
    Trial t = run_trial(assembly_, setting,
                        {.duration = duration,
                         .cpu_limit = cpu_limit(control),
                         .records = records,
                         .repeat = false});
    spent_ += t.spent_s;
    Candidate c{.method = d, .step = h, .control = control, .over_s = duration};
    const double error = t.report.energy.max_rel_error;
    if (!t.complete() || !std::isfinite(error) || !coupled(t)) return c;
    if (duration == pilot_s_ && !resolved(t)) return c;
    c.measured = error;
    c.expected = carried_on(t, error, scene_.duration / duration, safety);
    c.reaches = c.expected <= target_;
    while (c.reaches && t.report.cpu_s < 0.05 && t.timed < 4) spent_ += time_again(assembly_, t);
    c.cpu_s = t.report.cpu_s * scene_.duration / t.report.simulated_s;
    if (control != StepControl::fixed) return c;
    // A compromise of error and cost: half the error is worth four times the work.
    const auto price = [](const Candidate& x) { return x.expected * std::sqrt(x.cpu_s); };
    if (!(best_.expected < HUGE_VAL) || price(c) < price(best_)) best_ = c;
    return c;
  }

  static double cpu_limit(StepControl control) {
    return control == StepControl::fixed ? 2 : controls_s;
  }
  /// In the longest step that is tried the joints turn by a radian at most.
  double control_rate() const { return 1 / (longer_steps * largest_step_); }

  /// The worst error expected after `times` the duration of a trial. It grows at least like a
  /// random walk, and a chaotic motion may have larger extremes later (`safety`). A trial of the
  /// whole duration misses only what lies between its records.
  static double carried_on(const Trial& t, double error, double times, double safety) {
    if (times <= 1) return 2 * error;
    const double growth = t.early_energy_error > 0
                              ? std::clamp(std::log2(error / t.early_energy_error), 0.5, 1.0)
                              : 1.0;
    return safety * error * std::pow(times, growth);
  }

  Scene put_in(const Candidate& c, const std::optional<Candidate>& controlled) const {
    Scene s = scene_;
    s.method = c.method.name;
    s.step = c.step;
    if (!s.record_every_given)
      s.record_every = std::max(1.0, std::round(s.duration / 1000 / s.step)) * s.step;
    s.choice = fmt::format(
        "auto chose --method {} --step {}: {:.1e} is the energy error {}, {:g} is allowed; about "
        "{:.2g} s of CPU",
        s.method, s.step, c.measured,
        c.over_s < s.duration
            ? fmt::format("of a pilot over {:g} s, {:.1e} at worst expected over {:g} s", c.over_s,
                          c.expected, s.duration)
            : fmt::format("of a pilot over all of the {:g} s", s.duration),
        target_, c.cpu_s);
    if (controlled)
      s.choice += fmt::format(
          "; the same method with step = {:.3g}, step_control = \"{}\" and step_control_rate = "
          "{:.3g} about {:.2g} "
          "s",
          controlled->step, to_string(controlled->control), control_rate(), controlled->cpu_s);
    return s;
  }

  [[noreturn]] void refuse() const {
    const std::string head =
        fmt::format("target_energy_error is {:g}: no method is expected to keep it over {:g} s",
                    target_, scene_.duration);
    if (!(best_.expected < HUGE_VAL)) throw InvalidArgument(head + ", every pilot run failed");
    throw InvalidArgument(head + fmt::format("; about {:.1e} is in reach ({}, step {:g} s)",
                                             1.05 * best_.expected, best_.method.name, best_.step));
  }

  const Scene& scene_;
  const Assembly& assembly_;
  const double target_;
  StateScale scale_{assembly_.model->description()};
  double largest_step_ = 0, pilot_s_ = 0, spent_ = 0;
  double limit_s_ = most_pilots_s;  ///< of spent_, for pilots
  Candidate best_;
};

}  // namespace

Scene with_method_chosen(const Scene& scene, const Assembly& assembly) {
  return scene.method == auto_method ? MethodChoice(scene, assembly).run() : scene;
}

Scene with_method_of(const Checkpoint& checkpoint, const Scene& scene) {
  if (scene.method != auto_method) return scene;
  Scene s = scene;
  for (const auto& [name, value] : checkpoint.fingerprint) {
    if (name == "method") s.method = value;
    if (name == "step") s.step = std::stod(value);
    if (name == "record_every") s.record_every = std::stod(value);
    if (name == "choice") s.choice = value;
  }
  if (s.choice.empty()) s.choice = "left to auto";  // if the run was not: the difference says so
  return s;
}

Scene with_method_kept(const Scene& scene, const fs::path& out) {
  if (scene.method != auto_method) return scene;
  const fs::path folder = out / "parts" / "choice";
  if (!has_checkpoint(folder)) {
    const Scene chosen = with_method_chosen(scene, assemble(scene));
    const fs::path own =
        folder.string() + fmt::format(".{}.{:08x}", getpid(), std::random_device{}());
    make_folder(own);
    Checkpoint c;
    c.fingerprint = fingerprint(chosen);
    write_checkpoint(own, c);
    // The first process wins: a folder that is not empty is not replaced.
    std::error_code taken;
    fs::rename(own, folder, taken);
    if (taken) fs::remove_all(own);
  }
  const Checkpoint kept = read_checkpoint(folder);
  const Scene s = with_method_of(kept, scene);
  if (const auto changes = difference(kept.fingerprint, fingerprint(s)); !changes.empty())
    throw InvalidArgument(fmt::format("the method kept in {} was chosen for another ensemble: {}",
                                      folder.string(), changes));
  return s;
}

}  // namespace porthos::scene
