#include "integrators/derivatives/run_tangents.h"

#include <algorithm>

namespace porthos::integrators {

RunTangents::RunTangents(const std::string& method, const phs::Model& model, phs::State start,
                         double h, std::vector<Along> directions)
    : run_(model),
      pieces_(method, *run_.model, h),
      instants_(*run_.model),
      state_(std::move(start)),
      n_(size_t(model.description().nx)),
      changes_(size_t(pieces_.table().s) * n_),
      down_(n_),
      angles_(state_.turns.size()),
      kept_(instants_.size()),
      held_(instants_.values()) {
  require_size("x", state_.x.size(), n_);
  if (instants_.any() && !pieces_.by_table())
    throw InvalidArgument("'" + method + "' has no tangents with sampled controllers, and '" +
                          model.description().name + "' has '" + model.holds().front()->name +
                          "', expected Gauss collocation");
  if (instants_.any()) held_field_ = linearise_run<double>(*run_.model);
  const auto of_run = [&](const phs::Model* m) {
    return m && instants_.any() ? std::make_unique<RunModel>(*m, *run_.kept) : nullptr;
  };
  const auto system = [](const RunModel* in_run, const phs::Model* m) {
    return in_run ? in_run->instantiate<double>() : m ? m->instantiate<double>() : nullptr;
  };
  for (const Along& a : directions) {
    require_size("start of a tangent", a.start.size(), n_);
    if (a.up && !pieces_.by_table())
      throw InvalidArgument("a direction of '" + method +
                            "' contains parameters, which its tangents are not there for, expected "
                            "Gauss collocation");
    Tangent t{a.distance,
              of_run(a.up),
              of_run(a.down),
              nullptr,
              nullptr,
              make_step_variation(*run_.model, pieces_, StepVariation::Side::tangent),
              TwoWords(std::span<const double>(a.start)),
              std::vector<double>(instants_.memories(), 0.0)};
    t.up = system(t.up_model.get(), a.up);
    t.down = system(t.down_model.get(), a.down);
    tangents_.push_back(std::move(t));
  }
}

Outcome RunTangents::step() {
  const double t = time();
  const phs::State before = instants_.any() ? state_ : phs::State();
  const Outcome o = pieces_.step(state_);
  if (o != Outcome::ok) return fail(o, "the step", t);
  if (tangents_.empty()) return o;
  for (size_t i = 0; i < angles_.size(); ++i) angles_[i] = double(state_.turns[i]) * phs::two_pi_hi;
  if (instants_.any()) over_instants(before, t);
  for (size_t i = 0; i < pieces_.count(); ++i)
    for (Tangent& tangent : tangents_) {
      tangent.variation->at(pieces_[i], state_.turns);
      const Outcome of_tangent =
          tangent.variation->advance(tangent.value, field_changes(tangent, pieces_[i]));
      if (of_tangent != Outcome::ok) return fail(of_tangent, "a tangent of the step", t);
    }
  return Outcome::ok;
}

/// What the sampled controllers remember in the step, along each tangent.
void RunTangents::over_instants(const phs::State& before, double t) {
  instants_.keep(pieces_.method(), before, state_.turns, kept_);
  instants_.at(kept_, state_.turns, t);
  for (Tangent& tangent : tangents_) {
    instants_.forwards(tangent.value.x, tangent.memory);
    if (!tangent.up) continue;
    tangent.up->set_turn_angles(angles_);
    tangent.down->set_turn_angles(angles_);
    instants_.add_difference(*tangent.up, *tangent.down, tangent.distance, tangent.memory);
  }
}

/// ∂f/∂z at the stages, and what is held along it; empty along the start alone.
std::span<const double> RunTangents::field_changes(Tangent& tangent, const StepPiece& piece) {
  if (!tangent.up && !held_field_) return {};
  if (tangent.up) {
    tangent.up->set_turn_angles(angles_);
    tangent.down->set_turn_angles(angles_);
  }
  if (held_field_) held_field_->set_turn_angles(angles_);
  instants_.held(tangent.memory, held_);
  const double factor = 0.5 / tangent.distance;
  for (size_t i = 0; i < size_t(pieces_.table().s); ++i) {
    const auto Y = piece.Y.subspan(i * n_, n_);
    const auto to = std::span(changes_).subspan(i * n_, n_);
    const double at = piece.t + piece.h * pieces_.table().c[i];
    std::ranges::fill(to, 0.0);
    if (tangent.up) {
      tangent.up->field(at, Y, {}, to);
      tangent.down->field(at, Y, {}, down_);
      for (size_t k = 0; k < n_; ++k) to[k] = factor * (to[k] - down_[k]);
    }
    if (!held_field_) continue;
    held_field_->at(at, Y, down_);
    held_field_->add_held(held_, to);
  }
  return changes_;
}

void RunTangents::interpolate(double theta, std::span<double> x) const {
  (void)pieces_.method().interpolate(state_, theta, x);
}

Outcome RunTangents::fail(Outcome o, const char* what, double t) {
  remark_ = std::string(what) + " at t = " + number(t) + " s: " + to_string(o);
  return o;
}

}  // namespace porthos::integrators
