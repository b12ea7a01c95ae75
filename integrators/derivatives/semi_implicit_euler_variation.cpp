#include "integrators/derivatives/semi_implicit_euler_variation.h"

#include <algorithm>
#include <cmath>

#include "integrators/core/turns.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

class SemiImplicitEulerVariation final : public StepVariation {
 public:
  SemiImplicitEulerVariation(const phs::Model& model, Side side)
      : n_(size_t(model.description().nx)),
        adjoint_(side == Side::adjoint),
        turns_(model.description()),
        out_(n_) {
    for (Stage& s : stages_) {
      s.linear = linearise_run<double>(model);
      s.f.resize(n_);
      s.given.resize(n_);
    }
    gradient_.resize(parameters().size());
  }

  void at(const StepPiece& step, const std::vector<std::int64_t>& turns) override {
    h_ = step.h;
    turns_.when_changed(turns, [&](std::span<const double> angles) {
      for (Stage& s : stages_) s.linear->set_turn_angles(angles);
    });
    for (size_t i = 0; i < 2; ++i)
      stages_[i].linear->at(step.t, step.Y.subspan(i * n_, n_), stages_[i].f);
  }

  Outcome advance(TwoWords& v, std::span<const double> running) override {
    ++cost_.steps;
    const size_t nq = n_ / 2;
    const auto move = [&](size_t k) { v.add(k, h_ * out_[k]); };
    if (adjoint_)
      for (size_t i = 2; i-- > 0;) {
        const bool of_q = i == 1;
        Stage& s = stages_[i];
        for (size_t k = 0; k < n_; ++k) s.given[k] = (k < nq) == of_q ? v.x[k] + v.lo[k] : 0;
        s.linear->transpose_times(s.given, out_);
        for (size_t k = 0; k < n_; ++k) {
          if (!running.empty()) out_[k] += running[i * n_ + k] / 2;
          move(k);
        }
      }
    else
      for (size_t i = 0; i < 2; ++i) {
        Stage& s = stages_[i];
        for (size_t k = 0; k < n_; ++k) s.given[k] = v.x[k] + v.lo[k];
        s.linear->times(s.given, out_);
        for (size_t k = 0; k < n_ && !running.empty(); ++k) out_[k] += running[i * n_ + k];
        for (size_t k = 0; k < nq; ++k) move(i == 0 ? nq + k : k);
      }
    return std::ranges::all_of(v.x, [](double x) { return std::isfinite(x); })
               ? Outcome::ok
               : Outcome::not_finite;
  }

  void stages(std::span<double> to) const override {
    for (size_t i = 0; i < 2; ++i)
      std::ranges::copy(stages_[i].given, to.begin() + std::ptrdiff_t(i * n_));
  }

  void add_gradient(TwoWords& gradient) override {
    std::ranges::fill(gradient_, 0.0);
    for (Stage& s : stages_) s.linear->add_gradient(h_, gradient_);
    for (size_t a = 0; a < gradient_.size(); ++a) gradient.add(a, gradient_[a]);
  }
  double by_size() const override {
    double sum = 0;
    for (const Stage& s : stages_)
      for (size_t k = 0; k < n_; ++k) sum += s.given[k] * s.f[k];
    return h_ * sum;
  }
  const std::vector<std::string>& parameters() const override {
    return stages_[0].linear->parameters();
  }
  const Cost& cost() const override { return cost_; }

 private:
  struct Stage {
    std::unique_ptr<phs::Linearised<double>> linear;
    std::vector<double> f, given;  ///< given: δY or ℓ
  };

  size_t n_;
  bool adjoint_;
  double h_ = 0;
  Stage stages_[2];
  TurnKeeper<double> turns_;
  std::vector<double> out_, gradient_;
  Cost cost_;
};

}  // namespace

std::unique_ptr<StepVariation> make_semi_implicit_euler_variation(const phs::Model& model,
                                                                  StepVariation::Side side) {
  return std::make_unique<SemiImplicitEulerVariation>(model, side);
}

}  // namespace porthos::integrators
