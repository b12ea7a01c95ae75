#include "integrators/derivatives/run_tangents.h"

namespace porthos::integrators {

RunTangents::RunTangents(const std::string& method, const phs::Model& model, phs::State start,
                         double h, std::vector<Along> directions)
    : table_(gauss_table<double>(gauss_stages(method))),
      method_(make_integrator(method, model, h, {.port_work = false})),
      state_(std::move(start)),
      n_(size_t(model.description().nx)),
      stages_(size_t(table_.s) * n_),
      changes_(stages_),
      down_(n_),
      angles_(state_.turns.size()) {
  require_size("x", state_.x.size(), n_);
  const auto system = [](const phs::Model* m) { return m ? m->instantiate<double>() : nullptr; };
  for (const Along& a : directions) {
    require_size("start of a tangent", a.start.size(), n_);
    tangents_.push_back({a.distance, system(a.up), system(a.down),
                         make_step_variation(model, table_.s, h, StepVariation::Side::tangent),
                         TwoWords(std::span<const double>(a.start))});
  }
}

Outcome RunTangents::step() {
  const double t = method_->time(state_);
  const Outcome o = method_->step(state_);
  if (o != Outcome::ok) return fail(o, "the step", t);
  if (tangents_.empty()) return o;
  for (size_t i = 0; i < size_t(table_.s); ++i)
    interpolate(table_.c[i], std::span(stages_).subspan(i * n_, n_));
  for (size_t i = 0; i < angles_.size(); ++i) angles_[i] = double(state_.turns[i]) * phs::two_pi_hi;
  for (Tangent& tangent : tangents_) {
    tangent.variation->at(t, stages_, state_.turns);
    const Outcome of_tangent = tangent.variation->advance(tangent.value, field_changes(tangent, t));
    if (of_tangent != Outcome::ok) return fail(of_tangent, "a tangent of the step", t);
  }
  return Outcome::ok;
}

/// ∂f/∂z at the stages of the step that began at t; empty along the start alone.
std::span<const double> RunTangents::field_changes(Tangent& tangent, double t) {
  if (!tangent.up) return {};
  tangent.up->set_turn_angles(angles_);
  tangent.down->set_turn_angles(angles_);
  const double factor = 0.5 / tangent.distance;
  for (size_t i = 0; i < size_t(table_.s); ++i) {
    const auto Y = std::span<const double>(stages_).subspan(i * n_, n_);
    const auto to = std::span(changes_).subspan(i * n_, n_);
    const double at = t + method_->step_size() * table_.c[i];
    tangent.up->field(at, Y, {}, to);
    tangent.down->field(at, Y, {}, down_);
    for (size_t k = 0; k < n_; ++k) to[k] = factor * (to[k] - down_[k]);
  }
  return changes_;
}

void RunTangents::interpolate(double theta, std::span<double> x) const {
  (void)method_->interpolate(state_, theta, x);
}

Outcome RunTangents::fail(Outcome o, const char* what, double t) {
  remark_ = std::string(what) + " at t = " + number(t) + " s: " + to_string(o);
  return o;
}

}  // namespace porthos::integrators
