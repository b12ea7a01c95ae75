#include "integrators/derivatives/dual_step_variation.h"

#include <Eigen/Core>

#include "phs/scalars/derivative.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

using phs::Dual;

class DualStepVariation final : public StepVariation {
  using Vector = Eigen::VectorXd;

 public:
  DualStepVariation(const phs::Model& model, const std::string& method, Side side)
      : n_(size_t(model.description().nx)),
        adjoint_(side == Side::adjoint),
        method_(make_basic_integrator<Dual>(method, model, Dual(1.0), {.port_work = false})),
        start_(model.description(), std::vector<Dual>(n_)),
        state_(start_),
        change_(n_, n_),
        by_h_(n_),
        first_(n_) {
    (void)linearise_run<double>(model);  // refuses what has no derivative
  }

  void at(const StepPiece& step, const std::vector<std::int64_t>& turns) override {
    h_ = step.h;
    start_.turns = turns;
    for (size_t k = 0; k < n_; ++k) start_.x[k] = Dual(step.Y[k]);
    outcome_ = Outcome::ok;
    phs::along_each(start_.x, [&](size_t k) { take(step.t, Dual(h_), change_.col(Index(k))); });
    change_.diagonal().array() -= 1;
    take(step.t, Dual(h_, 1.0), by_h_);
  }

  /// Changes are added to both words.
  Outcome advance(TwoWords& v, std::span<const double> running) override {
    ++cost_.steps;
    if (outcome_ != Outcome::ok) return outcome_;
    const auto rate = [&](size_t stage, size_t k) {
      return running.empty() ? 0 : h_ / 2 * running[stage * n_ + k];
    };
    for (size_t k = 0; k < n_; ++k) {
      v.add(k, rate(1, k));
      first_[Index(k)] = v.x[k] + v.lo[k];
    }
    const Vector by = adjoint_ ? Vector(change_.transpose() * first_) : Vector(change_ * first_);
    if (!by.allFinite()) return Outcome::not_finite;
    for (size_t k = 0; k < n_; ++k) {
      v.add(k, by[Index(k)]);
      v.add(k, rate(0, k));
    }
    return Outcome::ok;
  }

  void add_gradient(TwoWords&) override {}
  double by_size() const override { return h_ * first_.dot(by_h_); }
  const std::vector<std::string>& parameters() const override { return none_; }
  const Cost& cost() const override { return cost_; }

 private:
  using Index = Eigen::Index;

  /// A step from start_ in duals; to: the second parts of its end.
  void take(double t, Dual h, Eigen::Ref<Vector> to) {
    state_ = start_;
    method_->tell_turns(state_);
    if (const Outcome o = method_->advance(Dual(t), h, state_); o != Outcome::ok) outcome_ = o;
    for (size_t k = 0; k < n_; ++k) to[Index(k)] = (state_.x[k] + state_.lo[k]).d;
  }

  size_t n_;
  bool adjoint_;
  double h_ = 0;
  std::unique_ptr<BasicIntegrator<Dual>> method_;
  phs::BasicState<Dual> start_, state_;
  Eigen::MatrixXd change_;  ///< DΦ - 1
  Vector by_h_, first_;     ///< ∂Φ/∂h; δx or λ' + (h/2) ∂r(x')
  Outcome outcome_ = Outcome::ok;
  std::vector<std::string> none_;
  Cost cost_;
};

}  // namespace

std::unique_ptr<StepVariation> make_dual_step_variation(const phs::Model& model,
                                                        const std::string& method,
                                                        StepVariation::Side side) {
  return std::make_unique<DualStepVariation>(model, method, side);
}

}  // namespace porthos::integrators
