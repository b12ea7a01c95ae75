#pragma once
#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/derivatives/step_variation.h"

/// Derivatives of single steps by their size. Private to event_*.cpp.
namespace porthos::integrators {

/// Single steps of a phase with their derivatives.
class PhaseSteps {
 public:
  PhaseSteps(const std::string& method, const phs::Model& model, double h)
      : model_(model),
        pieces_(method, model, h),
        fresh_(pieces_.method().memory()),
        adjoint_(make_step_variation(model, pieces_, StepVariation::Side::adjoint)),
        tangent_(make_step_variation(model, pieces_, StepVariation::Side::tangent)),
        system_(model.instantiate<double>()),
        n_(size_t(model.description().nx)),
        f_(n_),
        running_(size_t(pieces_.table().s) * n_) {
    if (!pieces_.by_table())
      throw InvalidArgument("'" + method +
                            "' has no derivative by the size of its steps, which events cut, "
                            "expected Gauss collocation");
    if (model.description().traits.autonomous) return;
    in_duals_ = model.instantiate<phs::Dual>();
    x_in_duals_.resize(n_);
    f_in_duals_.resize(n_);
  }
  const phs::Model& model() const { return model_; }
  const std::vector<std::string>& parameters() const { return adjoint_->parameters(); }

  /// Moves to the step of a run from a state.
  Outcome to(const phs::State& from, double size) {
    state_ = from;
    pieces_.method().restore(fresh_);
    const Outcome o = pieces_.step(state_, size);
    angles_ = angles_of(state_);
    return o;
  }
  /// The adjoint of that step.
  Outcome back(TwoWords& lambda, TwoWords& parameters) {
    adjoint_->forget();
    for (size_t i = pieces_.count(); i-- > 0;) {
      adjoint_->at(pieces_[i], state_.turns);
      const Outcome o = adjoint_->advance(lambda);
      if (o != Outcome::ok) return o;
      adjoint_->add_gradient(parameters);
    }
    return Outcome::ok;
  }
  /// The tangent of that step.
  Outcome forwards(TwoWords& v) {
    tangent_->forget();
    Outcome o = Outcome::ok;
    for (size_t i = 0; i < pieces_.count() && o == Outcome::ok; ++i) {
      tangent_->at(pieces_[i], state_.turns);
      o = tangent_->advance(v);
    }
    return o;
  }
  /// The state after that step.
  phs::State& state() { return state_; }
  double step_size() const { return pieces_.method().step_size(); }
  /// The change of its end by its size, and by the time at which it begins.
  Outcome by_times(double by_size, double by_start, std::vector<double>& change) {
    TwoWords v(n_);
    const StepPiece first = pieces_[0], last = pieces_[pieces_.count() - 1];
    const double h = last.t + last.h - first.t;
    tangent_->forget();
    system_->set_turn_angles(angles_);
    for (size_t i = 0; i < pieces_.count(); ++i) {
      const StepPiece piece = pieces_[i];
      for (size_t j = 0; j < size_t(pieces_.table().s); ++j) {
        const auto Y = piece.Y.subspan(j * n_, n_);
        const double t = piece.t + piece.h * pieces_.table().c[j];
        system_->field(t, Y, {}, f_);
        const double later = by_start + (t - first.t) / h * by_size;
        const auto drift = in_duals_ ? by_time(t, Y) : std::span<const phs::Dual>();
        for (size_t k = 0; k < n_; ++k)
          running_[j * n_ + k] = f_[k] * by_size / h + (drift.empty() ? 0 : drift[k].d * later);
      }
      tangent_->at(piece, state_.turns);
      const Outcome o = tangent_->advance(v, running_);
      if (o != Outcome::ok) return o;
    }
    change = v.x;
    return Outcome::ok;
  }
  /// The field at a state.
  std::span<const double> field(double t, const phs::State& s) {
    system_->set_turn_angles(angles_of(s));
    system_->field(t, s.x, {}, f_);
    return f_;
  }

 private:
  static std::vector<double> angles_of(const phs::State& s) {
    std::vector<double> angles;
    for (const auto turns : s.turns) angles.push_back(double(turns) * phs::two_pi_hi);
    return angles;
  }
  std::span<const phs::Dual> by_time(double t, std::span<const double> Y) {
    const std::vector<phs::Dual> angles(angles_.begin(), angles_.end());
    in_duals_->set_turn_angles(angles);
    std::copy(Y.begin(), Y.end(), x_in_duals_.begin());
    in_duals_->field(phs::Dual(t, 1.0), x_in_duals_, {}, f_in_duals_);
    return f_in_duals_;
  }

  const phs::Model& model_;
  StepPieces pieces_;
  std::vector<double> fresh_;  ///< memory of the method before any step
  std::unique_ptr<StepVariation> adjoint_, tangent_;
  std::unique_ptr<phs::System<double>> system_;
  std::unique_ptr<phs::System<phs::Dual>> in_duals_;  ///< of a field that depends on the time
  size_t n_;
  phs::State state_;
  std::vector<double> f_, running_, angles_;
  std::vector<phs::Dual> x_in_duals_, f_in_duals_;
};

}  // namespace porthos::integrators
