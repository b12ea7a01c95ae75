#include "scene/ensemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>

#include "ensemble/batch.h"
#include "scene/ledger.h"
#include "scene/verdict.h"
#include "space/split_integrator.h"

namespace porthos::scene {
namespace {

using integrators::Outcome;

integrators::Options method_options(const Scene& s, const phs::Description& d) {
  return {.rtol = s.rtol, .books = !d.powers.empty(), .iteration_tolerance = s.iteration_tolerance};
}

/// One case at work.
/// As the dataset "passed" has it: 0 failed, 1 passed, 2 not judged.
std::int64_t case_verdict(Verdict v) { return v == Verdict::pass ? 1 : v == Verdict::fail ? 0 : 2; }

class CaseRun final : public ensemble::BatchRun {
 public:
  using Done = std::function<void(std::span<const double>)>;

  CaseRun(const Ensemble& e, std::int64_t index, const Done& done)
      : e_(e), index_(index), done_(done) {}

  /// A case whose numbers the model refuses takes no step.
  void prepare() override {
    values_ = e_.sampler().values(index_);
    const Scene& nominal = e_.scene();
    start = e_.assembly().initial;
    try {
      Scene s = read_variation(nominal.path, nominal.text, e_.sampler().replacements(values_));
      s.urdf_text = nominal.urdf_text;  // should the file have been edited meanwhile
      const Assembly& a = e_.assembly();
      if (e_.one_model()) {
        assembly_.model = a.model, assembly_.mechanical = a.mechanical;
        assembly_.mechanism = a.mechanism, assembly_.spacecraft = a.spacecraft;
        auto begin = start_of(s, a);
        assembly_.initial = std::move(begin.state), assembly_.centre = std::move(begin.centre);
      } else {
        assembly_ = assemble(s);
      }
      if (!e_.one_model() || a.spacecraft)
        method_ = make_integrator(nominal, *assembly_.model, nominal.step);
    } catch (const InvalidArgument&) {
      refused_ = true;
      return;
    }
    start = assembly_.initial;
    steps = std::llround(nominal.duration / nominal.step);
    every = std::max<std::int64_t>(1, std::llround(nominal.record_every / nominal.step));
    books = !assembly_.model->description().powers.empty();
    meter_.emplace(assembly_);
    ledger_.emplace(assembly_.model->description());
    measure(start);
    if (!finite_) steps = 0;
  }
  integrators::Integrator* own_method() override { return method_.get(); }
  void booked(std::span<const double> works) override { ledger_->book(works); }
  bool see(const phs::State& s) override { return measure(s); }

  void end(const phs::State& reached, Outcome outcome) override {
    const CaseLayout& l = e_.layout();
    const double time = double(reached.step) * e_.scene().step;
    WorldView view(assembly_);
    const phs::State& last = view(time, reached);
    std::vector<double> row(l.size(), 0.0);
    const auto whole = [&](size_t at, std::int64_t value) {
      row[at] = std::bit_cast<double>(value);
    };
    std::copy(values_.begin(), values_.end(), row.begin() + long(l.inputs));
    std::copy(last.x.begin(), last.x.end(), row.begin() + long(l.x()));
    std::copy(last.lo.begin(), last.lo.end(), row.begin() + long(l.low()));
    for (size_t i = 0; i < l.turns; ++i) whole(l.turn() + i, last.turns[i]);
    whole(l.index, index_), whole(l.steps, last.step);
    if (!finite_) outcome = Outcome::not_finite;
    whole(l.status, refused_ ? case_refused : int(outcome));
    if (!refused_) {
      RunReport r;
      r.outcome = outcome, r.steps = last.step;
      r.simulated_s = time;
      ledger_->fill(r, *meter_);
      const auto* split = dynamic_cast<const space::SplitIntegrator*>(method_.get());
      if (split && split->ledgers().started()) r.space = split->ledgers().report();
      judge(r, e_.scene(),
            method_ ? method_->declaration() : integrators::declaration_of(e_.scene().method),
            *meter_);
      whole(l.passed, case_verdict(r.verdict()));
      row[l.energy_initial] = r.energy.initial_J, row[l.energy_scale] = r.energy.scale_J;
      row[l.energy_abs] = r.energy.max_abs_error_J, row[l.energy] = r.energy.max_rel_error;
      row[l.energy_rms] = r.energy.rms_rel_error;
      row[l.linear] = r.linear_momentum_error, row[l.angular] = r.angular_momentum_error;
      row[l.quaternion] = r.quaternion_norm_error;
    }
    l.seal(row);
    done_(row);
  }

 private:
  bool measure(const phs::State& s) {
    const Measured& m = meter_->measure(s);
    finite_ = m.finite() && std::isfinite(meter_->initial_J());
    if (finite_) ledger_->add(double(s.step) * e_.scene().step, m, s.step % every == 0);
    return finite_;
  }

  const Ensemble& e_;
  std::int64_t index_;
  const Done& done_;
  std::vector<double> values_;
  Assembly assembly_;
  std::unique_ptr<integrators::Integrator> method_;
  std::optional<Meter> meter_;
  std::optional<Ledger> ledger_;
  bool refused_ = false, finite_ = true;
};

}  // namespace

Ensemble::Ensemble(Scene scene)
    : scene_(std::move(scene)),
      assembly_(assemble(scene_)),
      cases_(read_ensemble(scene_, assembly_)),
      sampler_(cases_),
      layout_(size_t(cases_.columns()), assembly_.model->description()),
      one_model_(assembly_.model->holds().empty() &&  // what they hold belongs to the model
                 std::all_of(cases_.quantities.begin(), cases_.quantities.end(),
                             [](const Quantity& q) { return is_of_start(q.key); })) {
  (void)make_integrator(scene_, *assembly_.model,
                        scene_.step);  // refuses a method that does not fit
}

NamedTexts Ensemble::identity() const {
  auto texts = fingerprint(scene_);
  if (!cases_.table_text.empty()) texts.emplace_back("table of cases", sha256(cases_.table_text));
  return texts;
}

void Ensemble::work(const std::function<std::int64_t()>& next,
                    const std::function<void(std::span<const double>)>& done,
                    const WorkOptions& o) const {
  std::mutex one_at_a_time;
  const CaseRun::Done put = [&](std::span<const double> row) {
    const std::lock_guard lock(one_at_a_time);
    done(row);
  };
  const phs::Description& d = assembly_.model->description();
  ensemble::simulate_batch(*assembly_.model, scene_.method, scene_.step,
                           [&]() -> std::unique_ptr<ensemble::BatchRun> {
                             const std::lock_guard lock(one_at_a_time);
                             const std::int64_t index = next();
                             return index < 0 ? nullptr
                                              : std::make_unique<CaseRun>(*this, index, put);
                           },
                           {.threads = o.threads,
                            .lanes = o.lanes && one_model_ && !assembly_.spacecraft,
                            .own_models = !one_model_,
                            .method = method_options(scene_, d),
                            .stop = o.stop});
}

}  // namespace porthos::scene
