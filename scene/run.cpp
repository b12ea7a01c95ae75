#include "scene/run.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>

#include "scene/auto_method.h"
#include "scene/checkpoint.h"
#include "scene/files.h"
#include "scene/ledger.h"
#include "scene/limit_notes.h"
#include "scene/phases.h"
#include "scene/results.h"
#include "scene/steps.h"
#include "scene/verdict.h"
#include "space/split_integrator.h"

namespace porthos::scene {
namespace fs = std::filesystem;
namespace {

using integrators::Outcome;
using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double cpu_now() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// Says when to look at the clock: every so many steps that about a hundredth of a second lies
/// between.
class Pace {
 public:
  bool due() {
    if (--left_ > 0) return false;
    const double passed = since(last_);
    last_ = Clock::now();
    every_ = passed < 0.005  ? std::min(2 * every_, 1 << 20)
             : passed > 0.02 ? std::max(1, every_ / 2)
                             : every_;
    left_ = every_;
    return true;
  }

 private:
  int every_ = 1, left_ = 1;
  Clock::time_point last_ = Clock::now();
};

fs::path checkpoint_folder(const std::string& out) { return fs::path(out) / "checkpoint"; }

void refuse_unfinished(const std::string& out) {
  const fs::path folder = checkpoint_folder(out);
  if (has_checkpoint(folder) && read_checkpoint(folder).outcome == Outcome::ok)
    throw InvalidArgument(fmt::format(
        "{} holds an unfinished run: use --resume to continue it, or remove the folder", out));
}

/// A run at work: state, integrator, record log and what is known of the errors so far.
class Session {
 public:
  Session(const Scene& scene, const Assembly& assembly, const RunOptions& options)
      : scene_(scene),
        assembly_(assembly),
        options_(options),
        folder_(checkpoint_folder(options.out)),
        fixed_(scene.step_control == integrators::StepControl::fixed),
        own_(make()),
        events_(make_events()),
        integrator_(events_ ? &events_->method() : own_.get()),
        monitor_(dynamic_cast<integrators::EnergyMonitor*>(integrator_)),
        split_(dynamic_cast<space::SplitIntegrator*>(monitor_ ? &monitor_->inner() : integrator_)),
        meter_(assembly),
        view_(assembly),
        layout_(assembly.model->description(), scene.extrema),
        row_(layout_.size()),
        window_(assembly.model->description(), layout_),
        state_(assembly.initial),
        steps_(steps_of(scene)),
        end_(steps_.time(steps_.total)),
        ledger_(assembly.model->description()) {}

  RunReport run() {
    options_.resume ? resume() : start();
    loop();
    return interrupted_ ? report() : finish();
  }

 private:
  /// The scene's method, under its monitor if there is one.
  std::unique_ptr<integrators::Integrator> make() const {
    auto method = make_integrator(scene_, *assembly_.model, scene_.step);
    if (!scene_.monitor) return method;
    return std::make_unique<integrators::EnergyMonitor>(std::move(method), *assembly_.model,
                                                        scene_.step, *scene_.monitor);
  }
  /// What stops the run at an instant, or takes it from one back to whole steps.
  std::unique_ptr<integrators::EventStepper> make_events() {
    if (options_.until.empty() && assembly_.initial.origin_step == 0) return nullptr;
    return std::make_unique<integrators::EventStepper>(
        *assembly_.model, [this] { return own_ ? std::move(own_) : make(); }, options_.until,
        integrators::EventOptions{.samples = 1, .to_grid = true, .all_turns = true});
  }
  /// What the next step depends on besides the state.
  std::vector<double> memory() const {
    auto m = integrator_->memory();
    const auto held = integrator_->sampler().memory();
    m.insert(m.end(), held.begin(), held.end());
    return m;
  }
  void restore(std::span<const double> m) {
    const size_t held = integrator_->sampler().memory().size();
    if (m.size() < held) require_size("memory of the integrator", m.size(), held);
    integrator_->restore(m.first(m.size() - held));
    integrator_->sampler().restore(m.last(held));
  }
  fs::path log_path() const { return folder_ / "records.bin"; }
  bool resumable() const { return integrator_->declaration().resumable; }

  void start() {
    refuse_unfinished(options_.out);
    make_folder(folder_);
    keep_texts();
    log_ = std::make_unique<RecordLog>(log_path(), layout_);
    if (split_) split_->begin(state_);
    remember();
    record();
    if (outcome_ != Outcome::ok || resumable()) checkpoint();
  }

  /// Beside the checkpoint, so that a report can read the records of a run that has not come to its end.
  void keep_texts() const {
    if (scene_.text.empty()) return;
    std::ofstream(folder_ / "scene.toml", std::ios::binary) << scene_.text;
    std::ofstream(folder_ / "model.urdf", std::ios::binary) << scene_.urdf_text;
  }

  void resume() {
    if (!resumable())
      throw InvalidArgument(fmt::format(
          "a run by {} cannot be continued from a checkpoint: start it without --resume",
          scene_.method));
    const Checkpoint c = read_checkpoint(folder_);
    if (const auto changes = difference(c.fingerprint, fingerprint(scene_)); !changes.empty())
      throw InvalidArgument(
          fmt::format("the checkpoint in {} is of another run: {}", folder_.string(), changes));
    require_size("state of the checkpoint", c.state.x.size(), state_.x.size());
    state_ = c.state;
    restore(c.memory);
    integrator_->set_cost(c.cost);
    const size_t extrema = window_.memory().size();
    if (c.statistics.size() < extrema)
      require_size("statistics of the checkpoint", c.statistics.size(), extrema);
    const auto statistics = std::span<const double>(c.statistics);
    ledger_.restore(statistics.first(statistics.size() - extrema));
    window_.restore(statistics.last(extrema));
    cpu_before_ = c.cpu_s, wall_before_ = c.wall_s;
    log_ = std::make_unique<RecordLog>(log_path(), layout_, c.log);
    remember();
  }

  void loop() {
    cpu_start_ = cpu_now(), wall_start_ = Clock::now();
    first_fraction_ = fraction();
    auto saved = Clock::now(), told = saved;
    Pace pace;
    while (outcome_ == Outcome::ok && !ended()) {
      if (options_.stop && options_.stop->load(std::memory_order_relaxed)) {
        interrupted_ = true;
        break;
      }
      outcome_ = fixed_ ? fixed_step() : controlled_step();
      if (outcome_ != Outcome::ok) break;
      ledger_.book(integrator_->works());
      if (at_record() || ended())
        record();
      else
        between_records();
      if (!pace.due()) continue;
      if (since(told) > 0.25) tell(), told = Clock::now();
      if (since(saved) > scene_.checkpoint_every && resumable()) checkpoint(), saved = Clock::now();
    }
    cpu_before_ += cpu_now() - cpu_start_, wall_before_ += since(wall_start_);
    stopped_ = true;
    if (outcome_ != Outcome::ok || (interrupted_ && resumable())) checkpoint();
  }

  /// Whether the state stands at the end of a step of another size: at an event, or at a shorter step's end.
  bool off_the_grid() const { return state_.origin_step != 0; }
  double time() const {
    return fixed_ && !off_the_grid() ? steps_.time(state_.step) : integrator_->time(state_);
  }
  bool ended() const {
    if (until_ >= 0) return true;
    return fixed_ ? state_.step >= steps_.total && time() >= end_ : time() >= scene_.duration;
  }
  /// Whether the last step reached a record time: exactly where the steps are fixed, else it may lie behind by up to a step.
  bool at_record() const {
    if (fixed_) return steps_.at_record(state_.step) && !off_the_grid();
    const auto count = [&](double t) { return std::floor(t / scene_.record_every); };
    return state_.step == 0 || count(time()) > count(integrator_->time(before_));
  }
  Outcome fixed_step() {
    Outcome o;
    if (events_) {
      const auto r = events_->step(state_, steps_.last > 0 ? end_ : HUGE_VAL);
      o = r.outcome, until_ = r.event;
    } else {
      o = steps_.ends_short(state_.step) ? integrator_->step_by(state_, steps_.last)
                                         : integrator_->step(state_);
    }
    if (o == Outcome::ok && until_ < 0 && steps_.last > 0 && state_.step == steps_.total)
      state_.origin = end_, state_.origin_lo = 0;  // not its rounding
    return o;
  }
  /// A step of the control's choice; one that would pass the end is taken again by what is left.
  Outcome controlled_step() {
    before_ = state_;
    const Outcome o = integrator_->step(state_);
    if (o != Outcome::ok || time() <= scene_.duration) return o;
    state_ = before_;
    return integrator_->step_by(state_, (scene_.duration - state_.origin) - state_.origin_lo);
  }

  std::vector<double> ledgers() const {
    if (!split_ || !split_->ledgers().started()) return std::vector<double>(layout_.ledgers, 0.0);
    const auto now = split_->ledgers().now();
    return {now.begin(), now.end()};
  }
  /// Looks at the errors of a step between records, and at the extrema.
  void between_records() {
    const bool all = scene_.extrema == Extrema::all;
    const Measured* m = &unmeasured_;
    double error = 0;
    if (all || state_.step % steps_to_a_look(integrator_->cost()) == 0) {
      m = &meter_.look(state_);
      if (!m->finite()) return not_finite();
      error = ledger_.look(*m);
    }
    if (!window_.watches()) return;
    fill_record(layout_, time(), view_(time(), state_), all ? *m : unmeasured_, ledger_.works(),
                error, 0, ledgers(), row_);
    window_.see(row_);
  }
  void not_finite() {
    outcome_ = Outcome::not_finite;
    recall();
  }

  /// Measures and appends. A state whose energy is not a number is a failure, and the last record
  /// the last good state.
  void record() {
    const Measured& m = meter_.measure(state_);
    if (!m.finite() || !std::isfinite(meter_.initial_J())) return not_finite();
    const double error = ledger_.add(time(), m, at_record());
    fill_record(layout_, time(), view_(time(), state_), m, ledger_.works(), error,
                integrator_->cost().sweeps, ledgers(), row_);
    if (window_.watches()) window_.see(row_), window_.put(row_), window_.restart();
    log_->append(row_);
    remember();
  }

  struct Moment {
    phs::State state;
    std::vector<double> memory;
    integrators::Cost cost;
    Ledger ledger;
  };
  void remember() { good_.emplace(Moment{state_, memory(), integrator_->cost(), ledger_}); }
  void recall() {
    state_ = good_->state;
    restore(good_->memory);
    integrator_->set_cost(good_->cost);
    ledger_ = good_->ledger;
    window_.restart();
  }

  double cpu() const { return cpu_before_ + (stopped_ ? 0 : cpu_now() - cpu_start_); }
  double wall() const { return wall_before_ + (stopped_ ? 0 : since(wall_start_)); }

  void checkpoint() {
    log_->sync();
    auto statistics = ledger_.memory();
    const auto extrema = window_.memory();
    statistics.insert(statistics.end(), extrema.begin(), extrema.end());
    write_checkpoint(folder_, {fingerprint(scene_), outcome_, state_, memory(), integrator_->cost(),
                               std::move(statistics), log_->mark(), cpu(), wall()});
  }

  void tell() const {
    if (!options_.progress || steps_.total == 0) return;
    const double here = since(wall_start_), done = fraction();
    const double left = here * (1 - done) / std::max(1e-300, done - first_fraction_);
    options_.progress(done, wall(), left);
  }

  double fraction() const {
    return fixed_ ? double(state_.step) / double(steps_.total) : time() / scene_.duration;
  }

  RunReport report() const {
    RunReport r;
    r.title = scene_.title, r.method = scene_.method;
    r.step_control = scene_.step_control;
    r.step_s = scene_.step, r.simulated_s = time();
    r.cpu_s = cpu(), r.wall_s = wall();
    r.steps = state_.step;
    r.cost = integrator_->cost();
    ledger_.fill(r, meter_);
    if (split_ && split_->ledgers().started()) r.space = split_->ledgers().report();
    r.outcome = outcome_, r.interrupted = interrupted_;
    if (outcome_ != Outcome::ok && split_) r.trouble = split_->trouble();
    r.final_state = state_, r.until = until_;
    r.held = integrator_->sampler().memory();
    if (!scene_.choice.empty()) r.notes.push_back(scene_.choice);
    if (assembly_.mechanical) {
      std::vector<std::string> held;
      for (const Element& e : scene_.elements)
        if (e.type == "limits") held.push_back(e.joint);
      for (const auto& [state, when] :
           {std::pair{&assembly_.initial, "at the start"}, {&state_, "at the end"}})
        for (auto& note : notes_on_limits(*assembly_.mechanical, *state, when, held))
          r.notes.push_back(std::move(note));
    }
    for (auto& note : notes_on_numbers(scene_, r.cost.sweeps)) r.notes.push_back(std::move(note));
    if (const auto remark = integrator_->remark(); !remark.empty())
      r.notes.push_back(integrator_->declaration().rival ? remark
                                                         : "implicit equations by " + remark);
    if (!integrator_->works().empty() && !integrator_->keeps_books())
      r.notes.push_back(fmt::format(
          "{} keeps no books of its own: works are taken by Simpson's rule over each step, whose "
          "error (order 4 in the step) stands in the defect of the balance",
          scene_.method));
    if (monitor_ && !monitor_->text().empty()) r.notes.push_back(monitor_->text());
    if (interrupted_ && !resumable())
      r.notes.push_back(fmt::format(
          "a run by {} cannot be continued from a checkpoint, none was written", scene_.method));
    return r;
  }

  RunReport finish() {
    RunReport r = report();
    log_->sync();
    r.momentum = wheel_momentum(scene_, assembly_, log_path());
    r.impulses = impulses(scene_, assembly_, log_path());
    judge(r, scene_, integrator_->declaration(), meter_);
    const bool more = has_more_to_judge(r, scene_, options_.check_symmetry);
    write_results(options_.out, scene_, assembly_, more ? not_yet_judged(r) : r, log_path());
    if (more) {
      judge_beside(r, scene_, assembly_, options_.check_symmetry);
      write_verdict(options_.out, scene_, assembly_, r, log_path());
    }
    if (outcome_ != Outcome::ok) return r;  // the last good state stays
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
    return r;
  }

  /// What stands in the folder while the rest is checked: results, and no verdict.
  static RunReport not_yet_judged(RunReport r) {
    for (Check& c : r.checks) c.telling = false;
    r.notes.push_back("written before everything was checked: the verdict is still to come");
    return r;
  }

  const Scene& scene_;
  const Assembly& assembly_;
  const RunOptions& options_;
  const fs::path folder_;
  const bool fixed_;                                   ///< steps of the scene's size
  std::unique_ptr<integrators::Integrator> own_;       ///< null: the one of events_
  std::unique_ptr<integrators::EventStepper> events_;  ///< null: no step ends between whole ones
  integrators::Integrator* integrator_;
  integrators::EnergyMonitor* monitor_;  ///< null: none; else the integrator
  space::SplitIntegrator* split_;        ///< null: not in orbit
  Meter meter_;
  WorldView view_;  ///< records show the world
  RecordLayout layout_;
  std::vector<double> row_;
  const Measured unmeasured_{};
  Window window_;
  phs::State state_, before_;  ///< before_: of the step just taken, where steps vary
  const Steps steps_;          ///< where they are fixed
  const double end_;           ///< [s]
  Ledger ledger_;
  std::unique_ptr<RecordLog> log_;
  std::optional<Moment> good_;
  Outcome outcome_ = Outcome::ok;
  bool interrupted_ = false, stopped_ = false;
  int until_ = -1;  ///< which event ended the run
  double first_fraction_ = 0;
  double cpu_before_ = 0, wall_before_ = 0, cpu_start_ = cpu_now();
  Clock::time_point wall_start_ = Clock::now();
};

}  // namespace

RunReport run(const Scene& scene, const Assembly& assembly, const RunOptions& options) {
  if (!scene.events.empty()) return run_phases(scene, assembly, options);
  if (scene.method != auto_method) return Session(scene, assembly, options).run();
  if (!options.resume) refuse_unfinished(options.out);  // before the pilots
  const Scene chosen = options.resume
                           ? with_method_of(read_checkpoint(checkpoint_folder(options.out)), scene)
                           : with_method_chosen(scene, assembly);
  if (options.say) options.say(chosen.choice);
  return Session(chosen, assembly, options).run();
}

}  // namespace porthos::scene
