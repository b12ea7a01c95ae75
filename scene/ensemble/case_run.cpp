#include "scene/ensemble/case_run.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "energy_shaping/foreign_law.h"
#include "scene/assemble/stops.h"
#include "scene/run/ledger.h"
#include "scene/run/verdict.h"
#include "scene/session/memory_run.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;

/// Number in the dataset "passed": 0 failed, 1 passed, 2 not judged.
std::int64_t number_of(Verdict v) { return v == Verdict::pass ? 1 : v == Verdict::fail ? 0 : 2; }

/// The results of a case while they are filled in.
class CaseRow {
 public:
  CaseRow(const Ensemble& e, std::int64_t index, std::span<const double> values)
      : e_(e), l_(e.layout()), row_(l_.size(), 0.0) {
    put(l_.index, index);
    std::copy(values.begin(), values.end(), row_.begin() + long(l_.inputs));
    std::fill_n(row_.begin() + long(l_.event_time()), 2 * l_.events + 3 * l_.outputs, std::nan(""));
    if (l_.stops > 0) put(l_.stop(), -1);
  }

  /// Sets the final state, of this assembly.
  void end(const Assembly& a, double time, const phs::State& reached) {
    WorldView view(a);
    const phs::State& last = view(time, reached);
    put(l_.steps, last.step);
    fill_state([&](auto x, auto lo, auto turns) {
      e_.state_columns().put(a.model->description(), last, x, lo, turns);
    });
  }
  void locked(const std::map<std::string, mechanics::LockedJoint>& joints) {
    for (const auto& [name, joint] : joints)
      fill_state([&, &n = name, &j = joint](auto x, auto lo, auto turns) {
        e_.state_columns().put_locked(n, j, x, lo, turns);
      });
  }
  void happened(const Event* of_scene, const Happened& h) {
    const size_t k = size_t(h.event - of_scene);
    row_[l_.event_time() + k] = h.at;
    row_[l_.event_loss() + k] = h.impact.dissipated_J;
  }
  void report(const RunReport& r) {
    put(l_.passed, number_of(r.verdict()));
    put(l_.failed, e_.checks().failed(r));
    row_[l_.energy_initial] = r.energy.initial_J;
    row_[l_.energy_scale] = r.energy.scale_J;
    row_[l_.energy_abs] = r.energy.max_abs_error_J;
    row_[l_.energy] = r.energy.max_rel_error;
    row_[l_.energy_rms] = r.energy.rms_rel_error;
    row_[l_.linear] = r.linear_momentum_error;
    row_[l_.angular] = r.angular_momentum_error;
    row_[l_.quaternion] = r.quaternion_norm_error;
    for (size_t k = 0; k < r.outputs.size() && k < l_.outputs; ++k) {
      row_[l_.output_end() + k] = r.outputs[k].end;
      row_[l_.output_least() + k] = r.outputs[k].least;
      row_[l_.output_largest() + k] = r.outputs[k].largest;
    }
    if (l_.stops == 0) return;
    row_[l_.end_time()] = r.simulated_s;
    put(l_.open(), e_.checks().not_judged(r));
    const auto& stops = e_.scene().stops;
    for (size_t k = 0; r.stopped && k < stops.size(); ++k)
      if (stops[k].name == r.stopped->name) put(l_.stop(), std::int64_t(k));
  }
  void failed() { put(l_.passed, number_of(Verdict::fail)); }
  std::span<const double> sealed(int status) {
    put(l_.status, status);
    if (l_.stops > 0 && status != 0)
      put(l_.open(), e_.checks().not_judged(std::bit_cast<std::int64_t>(row_[l_.failed])));
    l_.seal(row_);
    return row_;
  }

 private:
  void put(size_t at, std::int64_t value) { row_[at] = std::bit_cast<double>(value); }
  template <class Fill>
  void fill_state(Fill fill) {
    const std::span<double> row(row_);
    std::vector<std::int64_t> turns(l_.turns);
    for (size_t i = 0; i < l_.turns; ++i)
      turns[i] = std::bit_cast<std::int64_t>(row[l_.turn() + i]);
    fill(row.subspan(l_.x(), l_.nx), row.subspan(l_.low(), l_.nx), std::span(turns));
    for (size_t i = 0; i < l_.turns; ++i) put(l_.turn() + i, turns[i]);
  }
  const Ensemble& e_;
  const CaseLayout& l_;
  std::vector<double> row_;
};

/// The scene of a case: the ensemble's scene as read, with the numbers of the case.
Scene scene_of(const Ensemble& e, std::int64_t index, std::span<const double> values) {
  const Scene& nominal = e.scene();
  Scene s = read_variation(nominal, e.sampler().replacements(values));
  s.method = nominal.method;  // which auto or the command line may have chosen, as what follows
  s.step = nominal.step;
  s.duration = nominal.duration;
  s.verify = nominal.verify;
  s.record_every = nominal.record_every;
  s.choice = nominal.choice;
  s.of_case = std::uint64_t(index) + 1;
  return s;
}

/// Calls f(). The message of a control law that fails gets the case in front.
template <class F>
auto in_case(std::int64_t index, F f) {
  try {
    return f();
  } catch (const energy_shaping::LawFailure& e) {
    throw energy_shaping::LawFailure(fmt::format("case {}: {}", index, e.what()));
  }
}

/// The assembly of a case that shares the ensemble's model.
Assembly from_its_start(const Ensemble& e, const Scene& s) {
  Assembly a = e.assembly();
  auto begin = start_of(s, a);
  a.initial = std::move(begin.state);
  a.centre = begin.centre;
  return a;
}

class LaneCase final : public ensemble::BatchRun {
 public:
  LaneCase(const Ensemble& e, std::int64_t index, const CaseDone& done)
      : e_(e), index_(index), done_(done) {}

  /// A case whose numbers the model refuses takes no steps.
  void prepare() override {
    values_ = e_.sampler().values(index_);
    assembly_ = e_.assembly();
    start = assembly_.initial;
    try {
      assembly_ = from_its_start(e_, scene_of(e_, index_, values_));
    } catch (const InvalidArgument&) {
      refused_ = true;
      return;
    }
    const Scene& s = e_.scene();
    start = assembly_.initial;
    steps = std::llround(s.duration / s.step);
    every = std::max<std::int64_t>(1, std::llround(s.record_every / s.step));
    look = steps_to_a_look_in_lanes;
    wants_port_work = !assembly_.model->description().powers.empty();
    meter_.emplace(assembly_);
    ledger_.emplace(assembly_.model->description());
    if (!see(start)) steps = 0;
  }
  void book(std::span<const double> works) override { ledger_->book(works); }
  bool see(const phs::State& s) override {
    const bool regular = s.step % every == 0, record = regular || s.step >= steps;
    const double t = double(s.step) * e_.scene().step;
    const Measured& m = record ? meter_->measure(t, s) : meter_->look(t, s);
    finite_ = m.finite() && std::isfinite(meter_->initial_J());
    if (!finite_) return false;
    if (record)
      ledger_->add(t, m, regular);
    else
      ledger_->look(m);
    return true;
  }
  void end(const phs::State& reached, Outcome outcome) override {
    CaseRow row(e_, index_, values_);
    const double time = double(reached.step) * e_.scene().step;
    row.end(assembly_, time, reached);
    if (refused_) return done_(row.sealed(case_refused));
    RunReport r;
    r.outcome = finite_ ? outcome : Outcome::not_finite;
    r.steps = reached.step;
    r.simulated_s = time;
    ledger_->fill(r, *meter_);
    judge(r, e_.scene(), integrators::declaration_of(e_.scene().method), *meter_);
    judge_beside(r, e_.scene(), assembly_, false);
    row.report(r);
    done_(row.sealed(int(r.outcome)));
  }

 private:
  const Ensemble& e_;
  std::int64_t index_;
  const CaseDone& done_;
  std::vector<double> values_;
  Assembly assembly_;
  std::optional<Meter> meter_;
  std::optional<Ledger> ledger_;
  bool refused_ = false, finite_ = true;
};

}  // namespace

std::unique_ptr<ensemble::BatchRun> make_lane_case(const Ensemble& e, std::int64_t index,
                                                   const CaseDone& done) {
  return std::make_unique<LaneCase>(e, index, done);
}

Assembly assembly_of_case(const Ensemble& e, std::int64_t index) {
  try {
    const Scene s = scene_of(e, index, e.sampler().values(index));
    return e.one_model() ? from_its_start(e, s) : assemble(s);
  } catch (const InvalidArgument& fault) {
    throw InvalidArgument(fmt::format("case {}: {}", index, fault.what()));
  }
}

void run_case(const Ensemble& e, std::int64_t index, const std::atomic<bool>* stop,
              const CaseDone& done) {
  const std::vector<double> values = e.sampler().values(index);
  CaseRow row(e, index, values);
  row.end(e.assembly(), 0, e.assembly().initial);
  Scene s;
  Assembly a;
  try {
    s = scene_of(e, index, values);
    a = e.one_model() ? from_its_start(e, s) : assemble(s);
    if (stop_that_holds(stop_events(s, a), a, 0, a.initial) >= 0)  // it would end where it begins
      return done(row.sealed(case_refused));
  } catch (const InvalidArgument&) {
    return done(row.sealed(case_refused));
  }
  const MemoryOptions o{.stop = stop};
  if (s.events.empty()) {
    const RunReport r = in_case(index, [&] { return run_in_memory(s, a, o); });
    if (r.interrupted) return;
    row.end(a, r.simulated_s, r.final_state);
    row.report(r);
    return done(row.sealed(int(r.outcome)));
  }
  std::optional<PhaseSequence> phases;
  bool refused = false;
  try {
    phases.emplace(s, a);
    (void)in_case(index, [&] { return run_in_memory(*phases, o); });
  } catch (const energy_shaping::LawFailure&) {
    throw;
  } catch (const InvalidArgument&) {  // out of reach, beyond a limit of the latch
    refused = true;
  }
  if (phases) {
    const RunReport& r = phases->whole().report();
    if (r.interrupted) return;
    if (phases->count() > 0) row.end(phases->last(), r.simulated_s, r.final_state);
    row.report(r);
    row.locked(phases->locked());
    for (const Happened& h : phases->happened()) row.happened(s.events.data(), h);
  }
  if (refused) row.failed();
  done(row.sealed(refused ? case_event_refused : int(phases->whole().report().outcome)));
}

}  // namespace porthos::scene
