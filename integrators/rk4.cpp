#include "integrators/rk4.h"

#include "integrators/catalogue.h"
#include "integrators/stagnation.h"

namespace porthos::integrators {
namespace {

template <class T>
class RungeKutta4 final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::system_, Base::works_;

 public:
  RungeKutta4(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o), k_(n_), y_(n_), sum_(n_) {}

  Outcome advance(T t, T h, typename Base::State& s) override {
    const T at[] = {T(0.0), T(0.5), T(0.5), T(1.0)};
    const T weight[] = {T(1.0) / T(6.0), T(1.0) / T(3.0), T(1.0) / T(3.0), T(1.0) / T(6.0)};
    std::fill(sum_.begin(), sum_.end(), T(0.0));
    works_.restart();
    for (int stage = 0; stage < 4; ++stage) {
      for (size_t i = 0; i < n_; ++i) y_[i] = stage == 0 ? s.x[i] : s.x[i] + at[stage] * h * k_[i];
      system_->field(t + at[stage] * h, y_, {}, k_);
      ++cost_.evaluations;
      for (size_t i = 0; i < n_; ++i) sum_[i] += h * weight[stage] * k_[i];
      if (works_.any()) works_.add(*system_, t + at[stage] * h, h * weight[stage], y_, k_);
    }
    for (const T& d : sum_)
      if (!(magnitude(d) < HUGE_VAL)) return Outcome::not_finite;
    for (size_t i = 0; i < n_; ++i) phs::compensated_add(s.x[i], s.lo[i], sum_[i]);
    return Outcome::ok;
  }

  bool keeps_books() const override { return true; }

 private:
  std::vector<T> k_, y_, sum_;
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_rk4(const Declaration& d, const phs::Model& m, T h,
                                             const Options& o) {
  return std::make_unique<RungeKutta4<T>>(d, m, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                                                    \
  template std::unique_ptr<BasicIntegrator<T>> make_rk4<T>(const Declaration&, const phs::Model&, \
                                                           T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries rk4_entries() {
  return {with_lanes(entry({.name = "rk4",
                            .title = "classical Runge-Kutta, a baseline that keeps nothing",
                            .family = "Baselines",
                            .order = 4,
                            .source = "Kutta 1901"},
                           PORTHOS_MAKER(make_rk4)),
                     [](const Declaration&, const phs::Model& m, double h, const Options& o) {
                       return make_lane_rk4(m, h, o);
                     })};
}

}  // namespace porthos::integrators
