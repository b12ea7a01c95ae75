// The system of a network: its members, joined by u = B Gᵀe + M v.
#include <algorithm>
#include <cmath>

#include "phs/network/detail/control_values.h"
#include "phs/network/detail/network_constraints.h"
#include "phs/network/detail/network_linearised.h"
#include "phs/network/detail/network_resolvent.h"
#include "phs/network/detail/resistances.h"
#include "phs/network/detail/sampled_controls.h"
#include "phs/network/detail/source_values.h"
#include "phs/network/detail/tank_flows.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;

template <class T>
class NetworkSystem final : public System<T>, public Differentiable<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit NetworkSystem(std::shared_ptr<const Plan> plan)
      : plan_(std::move(plan)),
        p_(*plan_),
        turn_(p_.description.blocks.size(), T(0.0)),
        u_(size_t(p_.nu())),
        v_(u_.size()),
        y_(u_.size()),
        e_(size_t(p_.nx())),
        Gu_(e_.size()),
        work_(e_.size()),
        controls_(p_),
        with_memory_(p_.sampled),
        tanks_(p_),
        sources_(p_.sources) {
    size_t most_invariants = 0;
    for (const auto& m : p_.members) {
      systems_.push_back(m.model->template instantiate<T>());
      most_invariants = std::max(most_invariants, size_t(m.model->description().invariant_count()));
    }
    invariants_.resize(most_invariants);
  }

  const Description& description() const override { return p_.description; }
  std::unique_ptr<System<T>> clone() const override {
    auto copy = std::make_unique<NetworkSystem>(plan_);
    copy->set_turn_angles(In(turn_).first(angles()));
    copy->controls_.use_held(controls_);
    copy->with_memory_.use(with_memory_.memories());
    return copy;
  }

  T hamiltonian(In x) override {
    T H(0.0);
    for (size_t i = 0; i < systems_.size(); ++i) H = H + systems_[i]->hamiltonian(state(i, x));
    for (const auto& s : p_.springs) H = H + (*s.U.energy)(elongation(s, x));
    for (const auto& s : p_.block_springs) H = H + s.U->energy(s.of(x));
    return H;
  }
  void gradient(In x, Out e) override {
    for (size_t i = 0; i < systems_.size(); ++i) systems_[i]->gradient(state(i, x), state(i, e));
    for (const auto& s : p_.springs)
      e[size_t(s.q)] = e[size_t(s.q)] + (*s.U.slope)(elongation(s, x));
    for (const auto& s : p_.block_springs) add_slope<T>(s, x, 1, s.q, e);
  }

  void field(T t, In x, In u, Out dx) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->field(t, state(i, x), {}, state(i, dx));
    for (const auto& s : p_.springs)
      dx[size_t(s.p)] = dx[size_t(s.p)] - (*s.U.slope)(elongation(s, x));
    for (const auto& s : p_.block_springs) add_slope<T>(s, x, -1, s.p, dx);
    for (size_t i = 0; i < systems_.size(); ++i)
      if (p_.members[i].active)
        systems_[i]->efforts(t, state(i, x), state(i, In(dx)), state(i, Out(e_)));
    flows(t, x, e_, u);
    add_inputs(x, dx);
    tanks_.add_rates(x, e_, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->rate(t, state(i, x), state(i, e), state(i, dx));
    flows(t, x, e, {});
    add_inputs(x, dx);
    tanks_.add_rates(x, e, dx);
  }
  /// Outputs see no part of e that depends on inputs: efforts without inputs give the inputs.
  void efforts(T t, In x, In dx, Out e) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->efforts(t, state(i, x), state(i, dx), state(i, e));
    if (!any_active()) return;
    flows(t, x, e, {});
    for (size_t i = 0; i < systems_.size(); ++i) {
      if (!p_.members[i].active) continue;
      const In Gu = inputs(i, x), dx_i = state(i, dx);
      for (size_t k = 0; k < Gu.size(); ++k) Gu_[k] = dx_i[k] - Gu[k];
      systems_[i]->efforts(t, state(i, x), In(Gu_).first(Gu.size()), state(i, e));
    }
  }

  void apply_structure(In x, In e, Out Je) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->apply_structure(state(i, x), state(i, e), state(i, Je));
    through_ports(x, e, p_.skew, T(1.0), Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->apply_dissipation(state(i, x), state(i, e), state(i, Re));
    through_ports(x, e, p_.sym, T(-1.0), Re);
    if (p_.laws.empty() && p_.bristles.empty()) return;
    // A nonlinear law enters R(x) as its secant at the flow of x.
    gradient(x, e_);
    outputs(x, e_);
    find_secants(p_, y_, v_);
    std::fill(y_.begin(), y_.end(), T(0.0));
    outputs(x, e);
    for (size_t k = 0; k < u_.size(); ++k) u_[k] = v_[k] * y_[k];
    add_inputs(x, Re);
  }
  void apply_input(In x, In u, Out Gu) override {
    std::fill(Gu.begin(), Gu.end(), T(0.0));
    std::fill(u_.begin(), u_.end(), T(0.0));
    for (size_t k = 0; k < u.size(); ++k) u_[size_t(p_.open[k])] = u[k];
    for (size_t i = 0; i < systems_.size(); ++i) {
      if (p_.members[i].nu == 0) continue;
      std::ranges::copy(inputs(i, x), state(i, Gu).begin());
    }
  }
  void output(In x, In e, Out y) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      if (p_.members[i].nu > 0) systems_[i]->output(state(i, x), state(i, e), ports(i, Out(y_)));
    for (size_t k = 0; k < y.size(); ++k) y[k] = y_[size_t(p_.open[k])];
  }

  void stored(In x, Out values) override {
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->stored(state(i, x), values.subspan(size_t(p_.members[i].stored)));
    size_t k = values.size() - p_.springs.size() - p_.block_springs.size();
    for (const auto& s : p_.springs) values[k++] = (*s.U.energy)(elongation(s, x));
    for (const auto& s : p_.block_springs) values[k++] = s.U->energy(s.of(x));
  }
  void powers(T t, In x, In e, Out values) override {
    size_t k = 0;
    for (size_t i = 0; i < systems_.size(); ++i) {
      systems_[i]->powers(t, state(i, x), state(i, e),
                          values.subspan(size_t(p_.members[i].powers)));
      k += p_.members[i].model->description().powers.size();
    }
    if (k == values.size()) return;
    flows(t, x, e, {});
    k = resistive_powers(p_, y_, values, k);
    for (const auto& r : p_.rayleighs) values[k++] = quadratic_form(r.D, y_);
    k = feedthrough_powers(p_, u_, values, k);
    k = sources_.powers(t, y_, values, k);
    for (size_t j = 0; j < p_.controls.size(); ++j) {
      const auto& c = p_.controls[j];
      const Out kappa = law(j, t, x);
      values[k] = power<T>(kappa, port(c, y_));
      if (c.tank >= 0) {
        if (c.hold) values[k] = power<T>(controls_.held(j), port(c, y_));
        values[k] = values[k] * tanks_.factor(c.tank, x, e);
      } else if (c.hold) {
        T held(0.0);
        for (size_t i = 0; i < kappa.size(); ++i)
          held = held + (controls_.held(j, i) - kappa[i]) * port(c, y_)[i];
        values[++k] = held;
      }
      ++k;
    }
    k = with_memory_.powers(x, e, y_, tanks_, values, k);
    tanks_.powers(x, e, y_, values, k);
  }
  void use_held(std::span<const HeldPtr> memories) override {
    controls_.use_held(memories);
    with_memory_.use(memories.subspan(controls_.sampled()));
  }
  void sample(size_t i, T t, In x, std::span<double> memory) override {
    if constexpr (requires { to_double(T(0.0)); }) {  // a Pack has no single clock
      gradient(x, e_);
      outputs(x, e_);
      if (i >= controls_.sampled())
        return with_memory_.sample(
            i - controls_.sampled(), t, [&](size_t k) { return unwrapped(k, x); }, y_, memory, p_);
      const size_t j = controls_.sampled(i);
      const auto& c = p_.controls[j];
      for (size_t k = 0; k < c.encoder.size(); ++k) {
        const double now = to_double(unwrapped(size_t(c.encoder[k]), x));
        double& last = memory[size_t(c.size) + k];
        if (!std::isnan(last)) port(c, y_)[k] = T((now - last) / c.hold->period);
        last = now;
      }
      unwrap(j, x);
      controls_.renew(j, t, y_, memory);
    }
  }

  void invariants(In x, Out values) override {
    size_t k = 0;
    for (size_t i = 0, next = 0; i < systems_.size() && next < p_.kept.size(); ++i) {
      const auto& of = p_.members[i].model->description();
      if (p_.kept[next].member != int(i)) continue;
      const Out all = Out(invariants_).first(size_t(of.invariant_count()));
      systems_[i]->invariants(state(i, x), all);
      for (; next < p_.kept.size() && p_.kept[next].member == int(i); ++next)
        values[k++] = all[size_t(p_.kept[next].at)];
    }
    for (const auto& c : p_.casimirs) {
      T sum(0.0);
      for (const auto& [at, weight] : c.terms) sum = sum + T(weight) * unwrapped(size_t(at), x);
      values[k++] = sum;
    }
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turn_.begin());
    for (size_t i = 0; i < systems_.size(); ++i)
      systems_[i]->set_turn_angles(
          angles.subspan(size_t(p_.members[i].angle), size_t(p_.members[i].angles)));
  }
  std::unique_ptr<Constraints<T>> constraints() override {
    return make_network_constraints<T>(p_, systems_);
  }
  std::unique_ptr<Resolvent> resolvent() override {
    if constexpr (std::is_same_v<T, double>) return make_network_resolvent(p_, systems_, turn_);
    return nullptr;
  }
  std::unique_ptr<Linearised<T>> linearised() override {
    return network_linearised<T>(p_, controls_, with_memory_);
  }
  std::unique_ptr<Linearised<BasicDual<T>>> linearised_in_duals() override {
    return network_linearised<BasicDual<T>>(p_, controls_, with_memory_);
  }

 private:
  template <class Span>
  auto state(size_t i, Span x) const {
    return x.subspan(size_t(p_.members[i].x), size_t(p_.members[i].nx));
  }
  template <class Span>
  auto ports(size_t i, Span u) const {
    return u.subspan(size_t(p_.members[i].u), size_t(p_.members[i].nu));
  }
  size_t angles() const { return size_t(p_.description.angle_count()); }
  bool any_active() const { return std::ranges::any_of(p_.members, &Plan::Member::active); }
  T unwrapped(size_t k, In x) const {
    return p_.turn_of[k] < 0 ? x[k] : x[k] + turn_[size_t(p_.turn_of[k])];
  }
  T elongation(const Plan::Spring& s, In x) const { return unwrapped(size_t(s.q), x); }

  /// y_ = Gᵀe of the members with active ports.
  void outputs(In x, In e) {
    for (size_t i = 0; i < systems_.size(); ++i)
      if (p_.members[i].active) systems_[i]->output(state(i, x), state(i, e), ports(i, Out(y_)));
  }
  /// y_ = Gᵀe + F u and u_ = (K - D) y + v, including the user's inputs u.
  void flows(T t, In x, In e, In u) {
    outputs(x, e);
    std::fill(v_.begin(), v_.end(), T(0.0));
    tanks_.begin(e, y_, v_);
    sources_.add(t, v_);
    add_resistances(p_, y_, v_);
    for (size_t j = 0; j < p_.controls.size(); ++j) {
      const auto& c = p_.controls[j];
      const Out v = port(c, v_), kappa = c.hold ? controls_.held(j) : law(j, t, x);
      const T factor = c.tank < 0 ? T(1.0) : tanks_.pay(c.tank, x, e, power<T>(kappa, port(c, y_)));
      for (size_t k = 0; k < v.size(); ++k) v[k] = v[k] + factor * kappa[k];
    }
    with_memory_.add(x, e, y_, tanks_, v_);
    for (size_t k = 0; k < u.size(); ++k) v_[size_t(p_.open[k])] = v_[size_t(p_.open[k])] + u[k];
    if (p_.M.empty()) {
      std::copy(v_.begin(), v_.end(), u_.begin());
    } else {
      std::fill(u_.begin(), u_.end(), T(0.0));
      add(p_.M, v_, u_);
    }
    add(p_.B, y_, u_);
    add(p_.F, u_, y_);
  }
  static void add(const std::vector<Plan::Term>& A, const std::vector<T>& x, std::vector<T>& y) {
    for (const auto& a : A) y[size_t(a.row)] = y[size_t(a.row)] + T(a.factor) * x[size_t(a.col)];
  }
  static Out port(const Plan::Control& c, std::vector<T>& v) {
    return Out(v).subspan(size_t(c.row), size_t(c.size));
  }
  /// The state that the law of control j sees.
  void unwrap(size_t j, In x) {
    const Out own = controls_.state(j);
    const size_t at = p_.seen(p_.controls[j]).first;
    for (size_t k = 0; k < own.size(); ++k) own[k] = unwrapped(at + k, x);
  }
  /// κ of control j at the flows y_.
  Out law(size_t j, T t, In x) {
    unwrap(j, x);
    return controls_.law(j, t, y_);
  }
  In inputs(size_t i, In x) {
    const Out Gu = Out(work_).first(size_t(p_.members[i].nx));
    systems_[i]->apply_input(state(i, x), ports(i, In(u_)), Gu);
    return Gu;
  }
  void add_inputs(In x, Out dx) {
    for (size_t i = 0; i < systems_.size(); ++i) {
      if (p_.members[i].nu == 0) continue;
      const In Gu = inputs(i, x);
      const Out to = state(i, dx);
      for (size_t k = 0; k < Gu.size(); ++k) to[k] = to[k] + Gu[k];
    }
  }
  /// out += sign · G A Gᵀ e
  void through_ports(In x, In e, const std::vector<Plan::Term>& A, T sign, Out out) {
    if (A.empty()) return;
    outputs(x, e);
    std::fill(u_.begin(), u_.end(), T(0.0));
    add(A, y_, u_);
    for (T& u : u_) u = sign * u;
    add_inputs(x, out);
  }

  std::shared_ptr<const Plan> plan_;
  const Plan& p_;
  std::vector<std::unique_ptr<System<T>>> systems_;
  std::vector<T> turn_, u_, v_, y_, e_, Gu_, work_, invariants_;
  ControlValues<T> controls_;
  SampledControls<T> with_memory_;
  TankFlows<T> tanks_;
  SourceValues<T> sources_;
};

}  // namespace

template <class T>
std::unique_ptr<System<T>> NetworkModel::make_system() const {
  return std::make_unique<NetworkSystem<T>>(plan_);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<System<T>> NetworkModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
