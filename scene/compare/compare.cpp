#include "scene/compare/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "scene/assemble/contacts.h"
#include "scene/compare/ladder.h"
#include "scene/compare/sound_method.h"
#include "scene/run/cpu_clock.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;
using integrators::StepControl;
using Clock = std::chrono::steady_clock;

/// Shares of the budget for the preparations and for repeated timings.
constexpr double sensitivity_share = 0.08, reference_share = 0.08, timing_share = 0.25;
constexpr int timings = 3;
constexpr std::int64_t first_steps = 100;  // that a step must complete

/// 1, 2 or 5 times a power of ten, at most x.
double round_down(double x) {
  const double ten = std::pow(10.0, std::floor(std::log10(x)));
  return ten * (x / ten >= 5 ? 5 : x / ten >= 2 ? 2 : 1);
}

void require_positive(const char* name, double x) {
  if (!std::isfinite(x) || x <= 0)
    throw InvalidArgument(fmt::format("{} is {}, expected more than 0 s", name, x));
}

class ComparisonRun {
 public:
  ComparisonRun(const Scene& scene, const Assembly& assembly, const CompareOptions& options)
      : scene_(scene),
        assembly_(assembly),
        options_(options),
        scale_(assembly.model->description()) {
    check(options);
    c_.title = scene.title;
    note_what_trials_leave_out();
    c_.budget_s = options.budget_s;
    c_.scene_duration_s = scene.duration;
    c_.duration_s = options.duration.value_or(scene.duration);
    c_.by_energy = assembly.model->description().powers.empty();
    guess_ = scene.step > 0 ? std::min(scene.step, c_.duration_s / 8) : c_.duration_s / 20;
  }

  Comparison run() {
    choose_methods();
    prepare();
    while (!stopped() && try_one()) {
    }
    while (!stopped() && time_once_more()) {
    }
    c_.interrupted = stopped();
    c_.cpu_s = passed();
    c_.wall_s = wall();
    std::erase_if(c_.methods, [](const auto& m) { return m.short_sweeps && m.trials.empty(); });
    for (auto& m : c_.methods) sort(m);
    return std::move(c_);
  }

 private:
  void note_what_trials_leave_out() {
    if (assembly_.spacecraft && !assembly_.spacecraft->parts().thrusters.empty())
      c_.notes.push_back(
          "thrusters switch at whole steps: the steps of most trials miss the times the scene "
          "states, and their errors hold that");
    if (!scene_.events.empty())
      c_.notes.push_back("[[event]]: the motion of the mechanism as it starts is compared");
    if (scene_.step_control != StepControl::fixed)
      c_.notes.push_back(
          "step_control: trials have steps of one size, except those that name a control");
    if (scene_.monitor) c_.notes.push_back("[monitor]: trials run without it");
  }

  bool stopped() const { return options_.stop && options_.stop->load(std::memory_order_relaxed); }
  double wall() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double passed() const { return thread_cpu_now() - cpu_start_; }
  double left() const { return options_.budget_s - passed(); }
  double left_for_trials() const { return left() - timing_share * options_.budget_s; }

  void tell(double least_fraction = 0) const {
    if (!options_.progress) return;
    const double f = std::clamp(std::max(passed() / options_.budget_s, least_fraction), 0.0, 1.0);
    const double pace = wall() / std::max(passed(), 1e-9);  // other programs use the processor too
    options_.progress(f, wall(), std::max(0.0, pace * left()));
  }

  const phs::Description& stepped() const { return assembly_.internal().description(); }

  void choose_methods() {
    for (const auto& d : integrators::catalogue()) {
      const auto& wanted = options_.methods;
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), d.name) == wanted.end())
        continue;
      if (const auto reason = integrators::misfit(d, stepped()))
        c_.skipped.emplace_back(d.name, *reason);
      else
        c_.methods.push_back({d, {}, false, false});
    }
    for (size_t i = 0; i < c_.methods.size(); ++i)
      if (has_short_sweeps(c_.methods[i])) {
        c_.methods.insert(c_.methods.begin() + long(i) + 1, c_.methods[i]);
        c_.methods[i + 1].short_sweeps = true;
      }
    add_step_controls();
  }

  /// The method of highest order that suits the system, with each step control.
  void add_step_controls() {
    const std::string name = sound_method(*assembly_.model, 16);
    const auto of = std::find_if(c_.methods.begin(), c_.methods.end(),
                                 [&](const auto& m) { return m.method.name == name; });
    if (of == c_.methods.end() || assembly_.spacecraft) return;
    const MethodTrials plain = *of;
    for (const auto control : {StepControl::time_transformed, StepControl::reversible}) {
      MethodTrials m = plain;
      m.control = control;
      try {
        with_touches(*assembly_.model, name, guess_, {}, [&](const phs::Model& model) {
          return make_controlled(control, name, model, guess_, {.length = scene_.control_length});
        });
        c_.methods.push_back(m);
      } catch (const InvalidArgument& why) {
        c_.skipped.emplace_back(m.label(), m.label() + ": " + why.what());
      }
    }
  }

  /// Methods of high order with large errors: there the sweeps to rounding are most of the work.
  static bool has_short_sweeps(const MethodTrials& m) {
    return m.method.family == "Gauss collocation" && m.method.order >= 8 && !m.short_sweeps;
  }

  void control(Setting& s) const {
    s.control_rate = scene_.control_rate > 0 ? scene_.control_rate : 1 / c_.step_s;
    s.control_length = scene_.control_length;
    s.instants = switches_and(scene_, {c_.trajectory_time_s, c_.duration_s});
  }

  /// Finds a step that works, the duration of trials, the time for which trajectories can be
  /// compared, and the reference at that time.
  void prepare() {
    c_.step_s = find_step(assembly_, guess_, first_steps, scale_);
    if (!options_.duration) shorten();
    tell();
    const double until = std::min(time_of_growth(), c_.duration_s);
    c_.trajectory_time_s = std::max(1.0, std::floor(until / c_.step_s * (1 + 1e-12))) * c_.step_s;
    tell();
    c_.reference = reference_state(assembly_, scale_,
                                   {.time = c_.trajectory_time_s,
                                    .step = c_.step_s,
                                    .cpu_limit = reference_share * options_.budget_s,
                                    .stop = options_.stop});
    tell();
    if (!c_.reference && !stopped())
      c_.notes.push_back("no reference trajectory: no two runs of " +
                         sound_method(*assembly_.model, 16) + " agree");
    for (const auto& m : c_.methods) {
      ladders_.emplace_back(m.method, c_.trajectory_time_s, c_.duration_s, c_.step_s);
      if (m.short_sweeps) ladders_.back().end();
    }
  }

  /// The time for which small deviations stay small.
  double time_of_growth() try {
    c_.sensitivity = sensitivity(assembly_, scale_,
                                 {.step = c_.step_s,
                                  .duration = c_.duration_s,
                                  .cpu_limit = sensitivity_share * options_.budget_s,
                                  .stop = options_.stop});
    return c_.sensitivity.time_of_growth(trajectory_growth);
  } catch (const InvalidArgument& why) {
    const bool jump = jumps(*assembly_.model);
    if (!assembly_.spacecraft && !jump) throw;
    c_.notes.push_back(
        fmt::format("how small deviations grow is not known: {}",
                    jump ? "the motion has jumps, or joints that stick" : why.what()));
    return HUGE_VAL;
  }

  /// A trial of gauss16 at the first step should fit eight times into a method's share of the
  /// budget.
  void shorten() {
    const auto method = make_integrator(assembly_, sound_method(*assembly_.model, 16), c_.step_s);
    phs::State s = assembly_.initial;
    const double start = thread_cpu_now();
    while (s.step < first_steps && method->step(s) == Outcome::ok) {
    }
    if (s.step == 0) return;
    const double per_step = (thread_cpu_now() - start) / double(s.step);
    const double share = options_.budget_s / double(8 * std::max<size_t>(1, c_.methods.size()));
    const double most = share / per_step * c_.step_s;
    if (most >= c_.duration_s) return;
    c_.duration_s = std::max(round_down(most), 8 * c_.step_s);
    c_.notes.push_back(fmt::format(
        "trials cover {:g} s of the scene's {:g} s to fit into {:g} s of computing: --duration or "
        "--budget change that",
        c_.duration_s, c_.scene_duration_s, options_.budget_s));
  }

  /// Runs the next trial of the method that has used the least time so far, if it fits into the
  /// budget. False: nothing left.
  bool try_one() {
    size_t best = ladders_.size();
    double least = HUGE_VAL;
    size_t done = 0;
    for (size_t i = 0; i < ladders_.size(); ++i) {
      Ladder& l = ladders_[i];
      if (!l.next()) {
        ++done;
        continue;
      }
      const bool first = c_.methods[i].trials.empty();  // every method has one
      if (!first && l.predicted_s() > left_for_trials()) {
        c_.methods[i].cut_short = true;
        l.end();
        continue;
      }
      const double cost = first ? -1 : l.spent_s() + l.predicted_s();
      if (cost < least) {
        least = cost;
        best = i;
      }
    }
    tell((1 - timing_share) * double(done) / double(std::max<size_t>(1, ladders_.size())));
    if (best == ladders_.size()) return false;
    take(best);
    return true;
  }

  /// Repeats the timing of the trial that was timed least often, the shortest first: a disturbance
  /// of a timing (another program, a changed clock rate) has ended by then. False: nothing left, or
  /// no time.
  bool time_once_more() {
    Trial* next = nullptr;
    for (auto& m : c_.methods)
      for (Trial& t : m.trials)
        if (t.complete() && t.timed < timings &&
            (!next ||
             std::pair(t.timed, t.report.cpu_s) < std::pair(next->timed, next->report.cpu_s)))
          next = &t;
    if (!next || next->report.cpu_s > left()) return false;
    tell();
    time_again(assembly_, *next);
    return true;
  }

  void take(size_t i) {
    Ladder& l = ladders_[i];
    const bool first = c_.methods[i].trials.empty();
    const double share = options_.budget_s / double(ladders_.size());
    Setting s = *l.next();
    s.control = c_.methods[i].control;
    if (s.control != StepControl::fixed) control(s);
    Trial t =
        run_trial(assembly_, s, trial_options(first ? share : std::max(left_for_trials(), 0.0)));
    l.take(t, c_.error_of(t));
    if (t.broken_off) c_.methods[i].cut_short = true;
    auto& trials = c_.methods[i].trials;
    trials.push_back(std::move(t));
    const auto refused = [](const Trial& each) { return each.refused; };
    if (trials.size() >= 3 && std::all_of(trials.end() - 3, trials.end(), refused))
      l.end();  // no step cures it
    if (i + 1 < c_.methods.size() && c_.methods[i + 1].short_sweeps) shorten_sweeps(i);
  }

  /// Repeats the last trial with sweeps that stop at its error.
  void shorten_sweeps(size_t i) {
    const Trial& full = c_.methods[i].trials.back();
    const double error = c_.error_of(full);
    if (!(error > 1e-13 && error < 1e-3) || full.report.cpu_s > left_for_trials()) return;
    Setting s = full.setting;
    s.iteration_tolerance = one_digit(error);
    Trial t = run_trial(assembly_, s, trial_options(std::max(left_for_trials(), 0.0)));
    ladders_[i].also_spent(t.spent_s);
    c_.methods[i + 1].trials.push_back(std::move(t));
  }
  static double one_digit(double x) { return std::stod(fmt::format("{:.0e}", x)); }

  TrialOptions trial_options(double cpu_limit) const {
    TrialOptions o{
        .duration = c_.duration_s, .cpu_limit = cpu_limit, .scale = &scale_, .stop = options_.stop};
    if (c_.reference) o.known = &*c_.reference;
    return o;
  }

  static void sort(MethodTrials& m) {
    std::sort(m.trials.begin(), m.trials.end(), [](const Trial& a, const Trial& b) {
      return a.setting.rtol != b.setting.rtol ? a.setting.rtol > b.setting.rtol
                                              : a.setting.step > b.setting.step;
    });
  }

  const Scene& scene_;
  const Assembly& assembly_;
  const CompareOptions& options_;
  const Clock::time_point start_ = Clock::now();
  const double cpu_start_ = thread_cpu_now();
  StateScale scale_;
  double guess_ = 0;
  std::vector<Ladder> ladders_;
  Comparison c_;
};

}  // namespace

double Comparison::error_of(const Trial& t) const {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  if (!t.complete()) return none;
  if (by_energy) return t.report.energy.max_rel_error;
  if (!t.trajectory_error) return none;
  // The reference may be a run of the same method with the same step.
  return reference ? std::max(*t.trajectory_error, reference->error) : *t.trajectory_error;
}

void check(const CompareOptions& options) {
  for (const auto& name : options.methods) integrators::declaration_of(name);
  require_positive("budget", options.budget_s);
  if (options.duration) require_positive("duration", *options.duration);
}

Comparison compare(const Scene& scene, const Assembly& assembly, const CompareOptions& options) {
  if (const auto holds = assembly.model->holds(); !holds.empty())
    throw InvalidArgument(fmt::format(
        "the controller '{}' is sampled, so the system is another one at every step size: expected "
        "a continuous controller to compare methods with",
        holds[0]->name));
  for (const Element& e : scene.elements)
    if (e.period > 0)
      throw InvalidArgument(fmt::format(
          "'{}' has pieces that fit some step sizes only: expected a smooth force to compare "
          "methods with",
          e.name));
  return ComparisonRun(scene, assembly, options).run();
}

}  // namespace porthos::scene
