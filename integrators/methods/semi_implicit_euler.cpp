#include "integrators/methods/semi_implicit_euler.h"

#include "integrators/core/entry.h"
#include "integrators/core/stagnation.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {
namespace {

template <class T>
class SemiImplicitEuler final : public BasicIntegrator<T>,
                                public StagedSteps<T>,
                                public SemiImplicitEulerSteps {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::system_;

 public:
  SemiImplicitEuler(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o), x_(n_), move_(n_), rate_(n_) {}

  Outcome advance(T t, T h, typename Base::State& s) override {
    const size_t nq = n_ / 2;
    system_->field(t, s.x, {}, rate_);
    for (size_t i = 0; i < nq; ++i) x_[i] = s.x[i];
    for (size_t i = nq; i < n_; ++i) {
      move_[i] = h * rate_[i];
      x_[i] = s.x[i] + move_[i];
    }
    system_->field(t, x_, {}, rate_);
    for (size_t i = 0; i < nq; ++i) move_[i] = h * rate_[i];
    cost_.evaluations += 2;
    for (const T& d : move_)
      if (!(magnitude(d) < HUGE_VAL)) return Outcome::not_finite;
    for (size_t i = 0; i < n_; ++i) phs::compensated_add(s.x[i], s.lo[i], move_[i]);
    return Outcome::ok;
  }
  /// For running costs: the trapezoidal rule.
  CollocationTable<TableReal<T>> table() const override {
    auto t = lobatto_table<TableReal<T>>(2);
    t.c.back() = t.c.front();  // f is asked at the start of the step
    return t;
  }
  void stages(const phs::BasicState<T>& after, std::span<T> Y) const override {
    for (size_t i = 0; i < n_; ++i) {
      Y[i] = after.x[i] + (after.lo[i] - move_[i]);
      Y[n_ + i] = i < n_ / 2 ? Y[i] : after.x[i] + after.lo[i];
    }
  }

 private:
  std::vector<T> x_, move_, rate_;
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_semi_implicit_euler(const Declaration& d,
                                                             const phs::Model& m, T h,
                                                             const Options& o) {
  return std::make_unique<SemiImplicitEuler<T>>(d, m, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                              \
  template std::unique_ptr<BasicIntegrator<T>> make_semi_implicit_euler<T>( \
      const Declaration&, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries semi_implicit_euler_entries() {
  return {entry({.name = "semi_implicit_euler",
                 .title = "semi-implicit Euler with explicit forces, as robotics engines step",
                 .family = "Baselines",
                 .order = 1,
                 .needs = {.canonical = true},
                 .source = "the default of MuJoCo: Todorov, Erez, Tassa 2012"},
                PORTHOS_MAKER(make_semi_implicit_euler))};
}

}  // namespace porthos::integrators
