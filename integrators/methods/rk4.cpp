#include "integrators/methods/rk4.h"

#include "integrators/core/step_rule.h"

namespace porthos::integrators {

template <class T>
class RungeKutta4 {
 public:
  static constexpr bool integrates_power = true;
  explicit RungeKutta4(const Workplace<T>& w)
      : work_(w), n_(size_t(w.model.description().nx)), k_(n_, T(0.0)), y_(k_), sum_(k_) {}

  LaneSet begin(LaneSet, const StepStart<T>&) { return 0; }

  Ended round(LaneSet lanes, const StepStart<T>& s) {
    const T at[] = {T(0.0), T(0.5), T(0.5), T(1.0)};
    const T weight[] = {T(1.0) / T(6.0), T(1.0) / T(3.0), T(1.0) / T(3.0), T(1.0) / T(6.0)};
    std::fill(sum_.begin(), sum_.end(), T(0.0));
    work_.port_work.restart();
    for (int stage = 0; stage < 4; ++stage) {
      const T c = at[stage] * s.h, hw = s.h * weight[stage], t = s.t + c;
      for (size_t i = 0; i < n_; ++i) y_[i] = stage == 0 ? s.x[i] : s.x[i] + c * k_[i];
      work_.system.field(t, y_, {}, k_);
      ++work_.cost.evaluations;
      for (size_t i = 0; i < n_; ++i) sum_[i] += hw * k_[i];
      if (work_.port_work.any()) work_.port_work.add(work_.system, t, hw, y_, k_);
    }
    auto finite = mask_of_some<T>(lanes);
    for (const T& d : sum_) finite = finite & (magnitude(d) < Size<T>(HUGE_VAL));
    const LaneSet done = lanes_of(finite);
    return {.done = done, .not_finite = lanes & ~done};
  }
  T move(size_t k) const { return sum_[k]; }

  void forget(LaneSet, const StepStart<T>&) {}
  void carry(Archive&, int) {}

 private:
  Workplace<T> work_;
  size_t n_;
  std::vector<T> k_, y_, sum_;
};

Entries rk4_entries() {
  return {
      entry_by_rule<RungeKutta4>({.name = "rk4",
                                  .title = "classical Runge-Kutta, a baseline that keeps nothing",
                                  .family = "Baselines",
                                  .order = 4,
                                  .source = "Kutta 1901"})};
}

}  // namespace porthos::integrators
