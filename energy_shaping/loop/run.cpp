#include "energy_shaping/loop/run.h"

#include <fmt/format.h>

#include <cmath>

#include "integrators/core/integrator.h"
#include "phs/system/forwarding.h"

namespace porthos::energy_shaping {

template <class T>
class DrivenPlant::Evaluator final : public phs::Driven<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit Evaluator(const DrivenPlant& m)
      : phs::Driven<T>(m.plant_.instantiate<T>(), m.description_),
        m_(m),
        loop_(m.loop_.loop<T>()),
        u_(size_t(m.plant_.description().nu), T(0.0)) {}
  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<Evaluator>(m_));
  }
  /// A law costs more than the plant's gradient, so it is not evaluated for the efforts.
  void efforts(T t, In x, In dx, Out e) override {
    if (m_.held_) return phs::Driven<T>::efforts(t, x, dx, e);
    this->gradient(x, e);
  }
  /// A law may be stiffer than the plant.
  std::unique_ptr<phs::Resolvent> resolvent() override {
    return m_.held_ ? phs::Driven<T>::resolvent() : nullptr;
  }

 private:
  In inputs(T t, In x) override {
    if (m_.held_) {
      for (size_t i = 0; i < u_.size(); ++i) u_[i] = T((*m_.held_)[i]);
      return u_;
    }
    loop_->law(t, x, u_);
    const auto& at = m_.loop_.actuated();
    for (size_t j = 0; j < m_.limits_.size(); ++j) {
      T& u = u_[size_t(at[j])];
      u = phs::max(phs::min(u, T(m_.limits_[j])), T(-m_.limits_[j]));
    }
    return u_;
  }
  const DrivenPlant& m_;
  std::unique_ptr<LoopSystem<T>> loop_;
  std::vector<T> u_;
};

DrivenPlant::DrivenPlant(const ClosedLoop& loop, const phs::Model& plant,
                         std::vector<double> limits,
                         std::shared_ptr<const std::vector<double>> held)
    : loop_(loop), plant_(plant), limits_(std::move(limits)), held_(std::move(held)) {
  description_ = plant.description();
  if (description_.nx != loop.plant().description().nx ||
      description_.nu != loop.plant().description().nu)
    throw InvalidArgument("the law of '" + loop.description().name + "' does not fit plant '" +
                          description_.name + "': state or inputs differ in number");
  check_limits(loop, limits_);
  if (held_) require_size("held inputs", held_->size(), size_t(description_.nu));
  for (auto& b : description_.blocks)
    if (b.kind == phs::BlockKind::angle) b.kind = phs::BlockKind::linear;
  description_.name += " under its law";
  description_.nu = 0;
  description_.ports.clear();
  description_.flows.clear();
  description_.invariants.clear();
  description_.traits.canonical = description_.traits.separable = false;
  description_.traits.lossless = false;
  description_.powers.push_back({"actuators", phs::PowerKind::supplied});
}

template <class T>
std::unique_ptr<phs::System<T>> DrivenPlant::make_system() const {
  return std::make_unique<Evaluator<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> DrivenPlant::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

void check_limits(const ClosedLoop& loop, const std::vector<double>& limits) {
  if (!limits.empty()) require_size("limits", limits.size(), loop.actuated().size());
  for (size_t j = 0; j < limits.size(); ++j)
    if (!(limits[j] > 0))
      throw InvalidArgument(
          fmt::format("limits[{}] is {:g}, expected the largest |u| of an actuated input, above 0",
                      j, limits[j]));
}

namespace {

/// The first input that was at its limit, and when.
struct AtLimit {
  size_t input = 0;
  double since = HUGE_VAL;  ///< [s]
};

/// H: H_d after the step that was the last. A law that left where it is meant after a limit acted
/// did not fail for its remedy, which is behind the colon.
std::string why_ended(const ClosedLoop& loop, const std::vector<double>& x0,
                      std::span<const double> x, double t, integrators::Outcome outcome, double H,
                      const AtLimit& limited) {
  if (const auto why = loop.hindrance(x); !why.empty()) {
    if (limited.since == HUGE_VAL || !loop.hindrance(x0).empty())
      return fmt::format("at {:.6g} s {}", t, why);
    return fmt::format(
        "at {:.6g} s {}: limits[{}] acted, first at {:.4g} s: take a larger one, or a start nearer "
        "to rest",
        t, why.substr(0, why.rfind(": ")), limited.input, limited.since);
  }
  if (outcome != integrators::Outcome::ok) return integrators::to_string(outcome);
  return fmt::format(
      "at {:.6g} s H_d is {}, expected a finite number: start nearer to the rest point, or take a "
      "shorter step",
      t, H);
}

/// 0: continuous.
std::int64_t steps_of_period(const RunOptions& o) {
  if (!(o.step > 0) || !(o.duration > 0))
    throw InvalidArgument("a run needs a step and a duration > 0");
  const auto hold = std::int64_t(std::llround(o.period / o.step));
  if (o.period != 0 && (hold < 1 || std::fabs(double(hold) * o.step - o.period) > 1e-9 * o.period))
    throw InvalidArgument(fmt::format(
        "the controller's period {} s is no multiple of the step {} s", o.period, o.step));
  return hold;
}

}  // namespace

Run simulate(const ClosedLoop& loop, const std::vector<double>& x0, const RunOptions& o) {
  const phs::Model& plant = o.plant ? *o.plant : loop.plant();
  require_size("start state", x0.size(), size_t(loop.description().nx));
  const auto hold = steps_of_period(o);
  const auto steps = std::int64_t(std::llround(o.duration / o.step));
  const auto every = o.record > 0 ? std::max<std::int64_t>(1, std::llround(o.record / o.step)) : 1;

  auto held = std::make_shared<std::vector<double>>(size_t(plant.description().nu), 0.0);
  const DrivenPlant driven(loop, plant, o.limits, hold > 0 ? held : nullptr);
  const auto integrator =
      integrators::make_integrator(o.method, driven, o.step, {.port_work = false});
  const auto law = loop.loop<double>();
  phs::State s(driven.description(), x0);
  std::vector<double> e(x0.size()), Re(x0.size()), u(held->size());
  const auto& at = loop.actuated();

  Run run;
  run.peak.assign(at.size(), 0.0);
  double H = law->hamiltonian(s.x), before = 0, middle = 0, trapezoids = 0, last = 0;
  const auto damping = [&] {
    law->gradient(s.x, e);
    law->apply_dissipation(s.x, e, Re);
    double P = 0;
    for (size_t i = 0; i < e.size(); ++i) P += e[i] * Re[i];
    return P;
  };
  AtLimit limited;
  const auto inputs = [&] {
    law->law(double(s.step) * o.step, s.x, u);
    for (size_t j = 0; j < o.limits.size(); ++j) {
      double& v = u[size_t(at[j])];
      if (limited.since == HUGE_VAL && std::fabs(v) > o.limits[j])
        limited = {j, double(s.step) * o.step};
      v = std::max(-o.limits[j], std::min(v, o.limits[j]));
    }
  };
  const auto record = [&] {
    run.t.push_back(double(s.step) * o.step);
    run.H.push_back(H);
    run.x.push_back(s.x);
    run.u.emplace_back();
    const auto& applied = hold > 0 ? *held : u;
    for (const int a : at) run.u.back().push_back(applied[size_t(a)]);
  };
  before = last = damping();
  for (std::int64_t k = 0;; ++k) {
    if (hold == 0 || k % hold == 0) inputs();
    if (hold > 0 && k % hold == 0) *held = u;
    for (size_t j = 0; j < at.size(); ++j)
      run.peak[j] = std::max(run.peak[j], std::fabs(u[size_t(at[j])]));
    if (k % every == 0 || k == steps) record();
    const auto end = [&](integrators::Outcome outcome, double energy) {
      run.finished = false;
      run.outcome = why_ended(loop, x0, s.x, double(s.step) * o.step, outcome, energy, limited);
    };
    const bool left = !loop.hindrance(s.x).empty();
    if (left) end(integrators::Outcome::ok, H);
    if (left || k == steps) break;
    const auto outcome = integrator->step(s);
    const double next = law->hamiltonian(s.x);
    if (outcome != integrators::Outcome::ok || !std::isfinite(next)) {
      end(outcome, next);
      break;
    }
    run.rise = std::max(run.rise, next - H);
    H = next;
    const double P = damping();
    trapezoids += 0.5 * o.step * (last + P);
    last = P;
    if (k % 2 == 0) {
      middle = P;
      if (k + 1 == steps) run.dissipated += 0.5 * o.step * (before + P);
    } else {
      run.dissipated += o.step / 3 * (before + 4 * middle + P);
      before = P;
    }
  }
  run.injected = H - run.H.front() + run.dissipated;
  run.quadrature = std::fabs(trapezoids - run.dissipated);
  return run;
}

}  // namespace porthos::energy_shaping
