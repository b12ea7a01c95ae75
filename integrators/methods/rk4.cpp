#include "integrators/methods/rk4.h"

#include "integrators/core/step_rule.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {

template <class T>
class RungeKutta4 {
 public:
  static constexpr bool integrates_power = true;
  explicit RungeKutta4(const Workplace<T>& w)
      : work_(w), n_(size_t(w.model.description().nx)), k_(n_, T(0.0)), sum_(k_), Y_(4 * n_) {}

  LaneSet begin(LaneSet, const StepStart<T>&) { return 0; }

  Ended round(LaneSet lanes, const StepStart<T>& s) {
    const T at[] = {T(0.0), T(0.5), T(0.5), T(1.0)};
    const T weight[] = {T(1.0) / T(6.0), T(1.0) / T(3.0), T(1.0) / T(3.0), T(1.0) / T(6.0)};
    std::fill(sum_.begin(), sum_.end(), T(0.0));
    work_.port_work.restart();
    for (int stage = 0; stage < 4; ++stage) {
      const T c = at[stage] * s.h, hw = s.h * weight[stage], t = s.t + c;
      const auto y = std::span(Y_).subspan(size_t(stage) * n_, n_);
      for (size_t i = 0; i < n_; ++i) y[i] = stage == 0 ? s.x[i] : s.x[i] + c * k_[i];
      work_.system.field(t, y, {}, k_);
      ++work_.cost.evaluations;
      for (size_t i = 0; i < n_; ++i) sum_[i] += hw * k_[i];
      if (work_.port_work.any()) work_.port_work.add(work_.system, t, hw, y, k_);
    }
    auto finite = mask_of_some<T>(lanes);
    for (const T& d : sum_) finite = finite & (magnitude(d) < Size<T>(HUGE_VAL));
    const LaneSet done = lanes_of(finite);
    return {.done = done, .not_finite = lanes & ~done};
  }
  T move(size_t k) const { return sum_[k]; }
  void stages(std::span<T> Y) const { std::copy(Y_.begin(), Y_.end(), Y.begin()); }

  void forget(LaneSet, const StepStart<T>&) {}
  void carry(Archive&, int) {}

 private:
  Workplace<T> work_;
  size_t n_;
  std::vector<T> k_, sum_, Y_;  ///< Y_: the four points, one after another
};

template <class T>
class RungeKutta4Steps final : public OneState<RungeKutta4, T>, public StagedSteps<T> {
 public:
  using OneState<RungeKutta4, T>::OneState;
  CollocationTable<TableReal<T>> table() const override {
    using phs::Quad;
    const Quad half = Quad(1) / 2, third = Quad(1) / 3, sixth = Quad(1) / 6;
    const Quad c[] = {0, half, half, 1}, b[] = {sixth, third, third, sixth};
    const Quad a[] = {0, 0, 0, 0, half, 0, 0, 0, 0, half, 0, 0, 0, 0, 1, 0};
    return runge_kutta_table<TableReal<T>>(c, b, a, 1);
  }
  void stages(const phs::BasicState<T>&, std::span<T> Y) const override { this->rule_.stages(Y); }
};

Entries rk4_entries() {
  return {entry_by_rule<RungeKutta4, RungeKutta4Steps>(
      {.name = "rk4",
       .title = "classical Runge-Kutta, a baseline that keeps nothing",
       .family = "Baselines",
       .order = 4,
       .source = "Kutta 1901"})};
}

}  // namespace porthos::integrators
