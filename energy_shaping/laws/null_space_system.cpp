// The system of a null-space posture: the task, the posture's force and the tank.
#include <algorithm>
#include <cmath>

#include "energy_shaping/laws/detail/null_space_projector.h"
#include "phs/functions/tank.h"

namespace porthos::energy_shaping {
namespace {

template <class T>
class NullSpaceSystem final : public LoopSystem<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit NullSpaceSystem(const NullSpaceLoop& loop)
      : loop_(loop),
        p_(loop.posture()),
        task_(loop.task().loop<T>()),
        projector_(loop),
        n_(p_.rest.size()),
        e_(2 * n_ + 1),
        y_(2 * n_),
        c_(n_),
        pull_(n_),
        felt_(n_) {}
  const phs::Description& description() const override { return loop_.description(); }
  std::unique_ptr<phs::System<T>> clone() const override {
    return std::make_unique<NullSpaceSystem>(loop_);
  }

  T hamiltonian(In x) override { return task_->hamiltonian(plant(x)) + spring(x) + x[2 * n_]; }
  void stored(In x, Out values) override {
    task_->stored(plant(x), values);
    values[2] = spring(x);
    values[3] = x[2 * n_];
  }
  void gradient(In x, Out e) override {
    task_->gradient(plant(x), e.first(2 * n_));
    pull(x);
    for (size_t i = 0; i < n_; ++i) e[i] = e[i] + pull_[i];
    e[2 * n_] = T(1.0);
  }
  void field(T t, In x, In u, Out dx) override {
    gradient(x, e_);
    rate(t, x, e_, dx);
    if (u.empty()) return;
    task_->apply_input(plant(x), u, y_);
    for (size_t i = 0; i < 2 * n_; ++i) dx[i] = dx[i] + y_[i];
  }
  void rate(T t, In x, In e, Out dx) override {
    task_->rate(t, plant(x), e.first(2 * n_), dx.first(2 * n_));
    couple(x);
    exchange(e, dx);
    for (size_t i = 0; i < n_; ++i)  // the tank's share of the damping is in c, not lost
      dx[n_ + i] = dx[n_ + i] + T(p_.fill * damping(i)) * e[n_ + i];
    dx[2 * n_] = dx[2 * n_] - valve_ * e[2 * n_];
  }
  void apply_structure(In x, In e, Out Je) override {
    task_->apply_structure(plant(x), e.first(2 * n_), Je.first(2 * n_));
    couple(x);
    exchange(e, Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    task_->apply_dissipation(plant(x), e.first(2 * n_), Re.first(2 * n_));
    couple(x);
    for (size_t i = 0; i < n_; ++i) Re[n_ + i] = Re[n_ + i] - T(p_.fill * damping(i)) * e[n_ + i];
    Re[2 * n_] = valve_ * e[2 * n_];
  }
  void apply_input(In x, In u, Out Gu) override {
    task_->apply_input(plant(x), u, Gu.first(2 * n_));
    Gu[2 * n_] = T(0.0);
  }
  void output(In x, In e, Out y) override { task_->output(plant(x), e.first(2 * n_), y); }
  void powers(T t, In x, In e, Out values) override {
    task_->powers(t, plant(x), e.first(2 * n_), values);
    couple(x);
    for (size_t i = 0; i < n_; ++i)
      values[0] = values[0] - T(p_.fill * damping(i)) * e[n_ + i] * e[n_ + i];
    values[1] = valve_ * e[2 * n_] * e[2 * n_];
  }
  void invariants(In, Out) override {}

  void law(T t, In x, Out u) override {
    task_->law(t, plant(x), u);
    couple(x);
    for (size_t i = 0; i < n_; ++i) u[i] = u[i] - pull_[i] + alpha_ * felt_[i];
  }

 private:
  In plant(In x) const { return x.first(2 * n_); }
  double damping(size_t i) const { return loop_.task().parts().damping[i]; }
  T spring(In x) const {
    T U(0.0);
    for (size_t i = 0; i < n_; ++i) {
      const T d = x[i] - T(p_.rest[i]);
      U = U + T(0.5 * p_.stiffness[i]) * d * d;
    }
    return U;
  }
  void pull(In x) {
    for (size_t i = 0; i < n_; ++i) pull_[i] = T(p_.stiffness[i]) * (x[i] - T(p_.rest[i]));
  }
  /// c, the valve and α at x.
  void couple(In x) {
    pull(x);
    projector_.place(x.first(n_));
    projector_.felt(pull_.data(), felt_.data());
    const T E = x[2 * n_];
    alpha_ = phs::tank_share(E, p_.least, p_.most);
    task_->gradient(plant(x), Out(y_));
    T inflow(0.0);
    for (size_t i = 0; i < n_; ++i) {
      const T rate = y_[n_ + i];
      c_[i] = alpha_ * felt_[i] - T(p_.fill * damping(i)) * rate;
      inflow = inflow - c_[i] * rate;
    }
    valve_ = phs::tank_overflow(E, p_.least, p_.most, inflow);
  }
  void exchange(In e, Out dx) {
    T given(0.0);
    for (size_t i = 0; i < n_; ++i) {
      dx[n_ + i] = dx[n_ + i] + c_[i] * e[2 * n_];
      given = given + c_[i] * e[n_ + i];
    }
    dx[2 * n_] = -given;
  }

  const NullSpaceLoop& loop_;
  const NullSpacePosture& p_;
  std::unique_ptr<LoopSystem<T>> task_;
  NullSpaceProjector<T> projector_;
  size_t n_;
  std::vector<T> e_, y_, c_, pull_, felt_;
  T alpha_{}, valve_{};
};

}  // namespace

template <class T>
std::unique_ptr<LoopSystem<T>> NullSpaceLoop::make_loop() const {
  return std::make_unique<NullSpaceSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<LoopSystem<T>> NullSpaceLoop::make_loop<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
