#include "integrators/rk4.h"

#include <cmath>

#include "integrators/turns.h"

namespace porthos::integrators {
namespace {

class RungeKutta4 final : public Integrator {
 public:
  RungeKutta4(const Declaration& d, const phs::Model& model, double h)
      : declaration_(d),
        h_(h),
        system_(model.instantiate<double>()),
        turns_(model.description()),
        n_(size_t(model.description().nx)),
        k_(n_),
        y_(n_),
        sum_(n_) {}

  const Declaration& declaration() const override { return declaration_; }
  double step_size() const override { return h_; }

  Outcome step(phs::State& s) override {
    turns_.synchronise(s, *system_);
    const double t = double(s.step) * h_;
    static constexpr double at[] = {0.0, 0.5, 0.5, 1.0},
                            weight[] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    std::fill(sum_.begin(), sum_.end(), 0.0);
    for (int stage = 0; stage < 4; ++stage) {
      for (size_t i = 0; i < n_; ++i) y_[i] = stage == 0 ? s.x[i] : s.x[i] + at[stage] * h_ * k_[i];
      system_->field(t + at[stage] * h_, y_, {}, k_);
      ++cost_.evaluations;
      for (size_t i = 0; i < n_; ++i) sum_[i] += h_ * weight[stage] * k_[i];
    }
    for (double d : sum_)
      if (!std::isfinite(d)) return Outcome::not_finite;
    for (size_t i = 0; i < n_; ++i) phs::compensated_add(s.x[i], s.lo[i], sum_[i]);
    ++s.step, ++cost_.steps;
    phs::wrap_angles(system_->description(), s);
    return Outcome::ok;
  }

 private:
  Declaration declaration_;
  double h_;
  std::unique_ptr<phs::System<double>> system_;
  TurnKeeper<double> turns_;
  size_t n_;
  std::vector<double> k_, y_, sum_;
};

}  // namespace

std::unique_ptr<Integrator> make_rk4(const Declaration& d, const phs::Model& model, double h,
                                     const Options&) {
  return std::make_unique<RungeKutta4>(d, model, h);
}

}  // namespace porthos::integrators
