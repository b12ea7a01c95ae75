#include "integrators/derivatives/discrete_gradient_variation.h"

#include <Eigen/LU>

#include "integrators/methods/discrete_field.h"
#include "phs/scalars/derivative.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

/// f̄ of a model in the scalar T.
template <class T>
struct DiscreteFieldOf {
  DiscreteFieldOf(const phs::Model& model, DiscreteGradientRule rule)
      : system(model.instantiate<T>()),
        turns(model.description()),
        field(rule, model, *system, false,
              rule == DiscreteGradientRule::gonzalez ? std::make_shared<InvariantGradients>(model)
                                                     : nullptr),
        x0(size_t(model.description().nx)),
        lo(x0.size(), T(0.0)),
        delta(x0),
        f(x0) {}

  std::unique_ptr<phs::System<T>> system;
  TurnKeeper<T> turns;
  DiscreteField<T> field;
  std::vector<T> x0, lo, delta, f;
};

class DiscreteGradientVariation final : public StepVariation {
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;

 public:
  DiscreteGradientVariation(const phs::Model& model, DiscreteGradientRule rule, Side side)
      : n_(size_t(model.description().nx)),
        adjoint_(side == Side::adjoint),
        linear_(linearise_run<double>(model)),
        turns_(model.description()),
        dual_(model, rule),
        plain_(model, rule),
        by_start_(n_, n_),
        equations_(n_, n_),
        solution_(Vector::Zero(Eigen::Index(n_))),
        z_(n_),
        out_(n_) {
    const auto& d = model.description();
    if (d.traits.canonical && d.traits.lossless && d.traits.autonomous && d.powers.empty())
      names_ = linear_->parameters();
    gradient_.resize(names_.size());
  }

  void at(const StepPiece& step, const std::vector<std::int64_t>& turns) override {
    h_ = step.h;
    t_ = step.t + step.h / 2;
    turns_.when_changed(turns, [&](std::span<const double> a) { linear_->set_turn_angles(a); });
    dual_.turns.synchronise(turns, *dual_.system);
    plain_.turns.synchronise(turns, *plain_.system);
    for (size_t k = 0; k < n_; ++k) {
      plain_.delta[k] = step.multipliers[k];
      plain_.x0[k] = step.Y[k] - plain_.delta[k] / 2;
      dual_.delta[k] = phs::Dual(plain_.delta[k]);
      dual_.x0[k] = phs::Dual(plain_.x0[k]);
    }
    equations_.setIdentity();
    phs::along_each(dual_.x0, [&](size_t k) { by_start_.col(Eigen::Index(k)) = column(); });
    phs::along_each(dual_.delta, [&](size_t k) { equations_.col(Eigen::Index(k)) -= column(); });
    lu_.compute(equations_);
    ++cost_.factorisations;
  }

  Outcome advance(TwoWords& v, std::span<const double> running) override {
    ++cost_.steps;
    Vector first(n_);
    for (Eigen::Index k = 0; k < first.size(); ++k) first[k] = v.x[size_t(k)] + v.lo[size_t(k)];
    const Eigen::Map<const Vector> rate(running.data(), Eigen::Index(running.size()));
    if (adjoint_ && !running.empty()) first += h_ / 2 * rate;
    const Vector change =
        adjoint_ ? Vector(by_start_.transpose() * solve(first)) : solve(Vector(by_start_ * first));
    if (!change.allFinite()) return Outcome::not_finite;
    for (Eigen::Index k = 0; k < first.size(); ++k) v.add(size_t(k), change[k]);
    for (size_t k = 0; k < running.size(); ++k) v.add(k, h_ * running[k]);
    return Outcome::ok;
  }

  void add_gradient(TwoWords& gradient) override {
    if (names_.empty()) return;
    std::fill(gradient_.begin(), gradient_.end(), 0.0);
    plain_.field.start_at(plain_.x0, plain_.lo);
    plain_.field(t_, plain_.delta, plain_.f);
    const size_t half = n_ / 2;
    const auto m = [&](size_t k) { return solution_[Eigen::Index(k)]; };
    for (size_t i = 0; i < half; ++i) {  // w = Jᵀ m
      z_[i] = -m(half + i);
      z_[half + i] = m(i);
    }
    std::vector<double> lambda(n_), point(n_);
    plain_.field.each_part(plain_.delta, z_, [&](auto z, auto c) {
      for (size_t i = 0; i < half; ++i) {  // the λ whose Jᵀλ is c
        lambda[i] = c[half + i];
        lambda[half + i] = -c[i];
      }
      linear_->at(t_, z, point);
      linear_->transpose_times(lambda, out_);
      linear_->add_gradient(h_, gradient_);
    });
    for (size_t a = 0; a < gradient_.size(); ++a) gradient.add(a, gradient_[a]);
  }
  double by_size() const override {
    double sum = 0;
    for (size_t k = 0; k < n_; ++k) sum += solution_[Eigen::Index(k)] * plain_.delta[k];
    return sum;
  }
  const std::vector<std::string>& parameters() const override { return names_; }
  const Cost& cost() const override { return cost_; }

 private:
  /// h f̄ along the direction of the duals.
  Vector column() {
    dual_.field.start_at(dual_.x0, dual_.lo);
    dual_.field(phs::Dual(t_), dual_.delta, dual_.f);
    cost_.evaluations += dual_.field.evaluations();
    Vector c(n_);
    for (Eigen::Index k = 0; k < c.size(); ++k) c[k] = h_ * dual_.f[size_t(k)].d;
    return c;
  }
  /// solution_: of the equations, or of their transpose, refined once.
  const Vector& solve(const Vector& right) {
    const auto once = [&](const Vector& r) {
      return adjoint_ ? Vector(lu_.transpose().solve(r)) : Vector(lu_.solve(r));
    };
    solution_ = once(right);
    const Vector left =
        adjoint_ ? Vector(equations_.transpose() * solution_) : Vector(equations_ * solution_);
    solution_ += once(right - left);
    return solution_;
  }

  size_t n_;
  bool adjoint_;
  double h_ = 0, t_ = 0;  ///< of the step; its middle
  std::unique_ptr<phs::Linearised<double>> linear_;
  TurnKeeper<double> turns_;
  DiscreteFieldOf<phs::Dual> dual_;
  DiscreteFieldOf<double> plain_;
  Matrix by_start_, equations_;  ///< h ∂f̄/∂x0, 1 - h ∂f̄/∂δ
  Eigen::PartialPivLU<Matrix> lu_;
  Vector solution_;  ///< δδ or m
  std::vector<double> z_, out_, gradient_;
  std::vector<std::string> names_;
  Cost cost_;
};

}  // namespace

std::unique_ptr<StepVariation> make_discrete_gradient_variation(const phs::Model& model,
                                                                DiscreteGradientRule rule,
                                                                StepVariation::Side side) {
  return std::make_unique<DiscreteGradientVariation>(model, rule, side);
}

}  // namespace porthos::integrators
