#include "integrators/derivatives/run_tangents.h"

namespace porthos::integrators {

RunTangents::RunTangents(const std::string& method, const phs::Model& model, phs::State start,
                         double h, std::vector<Along> directions)
    : pieces_(method, model, h),
      state_(std::move(start)),
      n_(size_t(model.description().nx)),
      changes_(size_t(pieces_.table().s) * n_),
      down_(n_),
      angles_(state_.turns.size()) {
  require_size("x", state_.x.size(), n_);
  const auto system = [](const phs::Model* m) { return m ? m->instantiate<double>() : nullptr; };
  for (const Along& a : directions) {
    require_size("start of a tangent", a.start.size(), n_);
    if (a.up && !pieces_.by_table())
      throw InvalidArgument("a direction of '" + method +
                            "' contains parameters, which its tangents are not there for, expected "
                            "Gauss collocation");
    tangents_.push_back({a.distance, system(a.up), system(a.down),
                         make_step_variation(model, pieces_, StepVariation::Side::tangent),
                         TwoWords(std::span<const double>(a.start))});
  }
}

Outcome RunTangents::step() {
  const double t = time();
  const Outcome o = pieces_.step(state_);
  if (o != Outcome::ok) return fail(o, "the step", t);
  if (tangents_.empty()) return o;
  for (size_t i = 0; i < angles_.size(); ++i) angles_[i] = double(state_.turns[i]) * phs::two_pi_hi;
  for (size_t i = 0; i < pieces_.count(); ++i)
    for (Tangent& tangent : tangents_) {
      tangent.variation->at(pieces_[i], state_.turns);
      const Outcome of_tangent =
          tangent.variation->advance(tangent.value, field_changes(tangent, pieces_[i]));
      if (of_tangent != Outcome::ok) return fail(of_tangent, "a tangent of the step", t);
    }
  return Outcome::ok;
}

/// ∂f/∂z at the stages; empty along the start alone.
std::span<const double> RunTangents::field_changes(Tangent& tangent, const StepPiece& piece) {
  if (!tangent.up) return {};
  tangent.up->set_turn_angles(angles_);
  tangent.down->set_turn_angles(angles_);
  const double factor = 0.5 / tangent.distance;
  for (size_t i = 0; i < size_t(pieces_.table().s); ++i) {
    const auto Y = piece.Y.subspan(i * n_, n_);
    const auto to = std::span(changes_).subspan(i * n_, n_);
    const double at = piece.t + piece.h * pieces_.table().c[i];
    tangent.up->field(at, Y, {}, to);
    tangent.down->field(at, Y, {}, down_);
    for (size_t k = 0; k < n_; ++k) to[k] = factor * (to[k] - down_[k]);
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
