#include "integrators/methods/rattle.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "integrators/core/turns.h"
#include "integrators/methods/manifold.h"
#include "integrators/methods/unit_quaternions.h"

namespace porthos::integrators {
namespace {

template <class T>
class Rattle final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::options_, Base::system_, Base::port_work_;
  using typename Base::State;

 public:
  Rattle(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        n_(Base::n_ / 2),
        m_(size_t(model.description().constraint_count())),
        rotations_(*system_),
        sizes_(model.description()),
        keeper_(model.description()),
        end_(unit_roundoff<T>, o.iteration_tolerance),
        start_(2 * n_, T(0.0)),
        lambda_(m_, T(0.0)),
        g_(lambda_),
        last_impulse_(lambda_),
        first_slip_(lambda_),
        first_drift_(lambda_),
        slip_(lambda_) {
    for (auto* x : {&before_, &before_lo_, &first_, &second_, &f_first_, &f_second_, &push_})
      x->assign(2 * n_, T(0.0));
    size_t of_constraints = 0;
    for (const auto& block : model.description().constraints) of_constraints += block.power >= 0;
    has_powers_ = model.description().powers.size() > of_constraints;
    if (m_ == 0) return;
    manifold_.emplace(*system_, m_, cost_);
    rows_after_ = system_->constraints();
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    if (m_ == 0) return;
    keeper_.when_changed(state.turns, [&](std::span<const T> angles) {
      manifold_->rows().set_turn_angles(angles);
      rows_after_->set_turn_angles(angles);
    });
  }

  Outcome advance(T t, T h, State& s) override {
    t_ = t;
    h_ = h;
    for (size_t k = 0; k < 2 * n_; ++k) start_[k] = s.x[k] + s.lo[k];
    if (m_ > 0 && !begin_rows(s)) return give_up(Outcome::singular);
    Outcome o = iterate();
    if (o != Outcome::ok) {  // multipliers of the last step may mislead it
      forget();
      o = iterate();
    }
    if (o == Outcome::ok) o = finish(s);
    return o == Outcome::ok ? o : give_up(o);
  }

  void carry(Archive& a) override {
    for (auto& r : rotations_.all) a(r.lambda);
    a(lambda_);
    a(slip_);
    if (m_ > 0) manifold_->rows().carry(a);
  }
  std::string remark() const override { return m_ > 0 ? manifold_->rows().trouble() : ""; }
  bool integrates_power() const override { return true; }
  bool sees_inside() const override { return false; }

 private:
  /// The rows at the start of the step. @return whether they have the rank they had
  bool begin_rows(const State& s) {
    auto& rows = manifold_->rows();
    rows->set_time(t_);
    std::fill(first_drift_.begin(), first_drift_.end(), T(0.0));
    rows->add_drift(first_drift_);
    if (!rows.choose(s.x)) std::fill(lambda_.begin(), lambda_.end(), T(0.0));
    rows_after_->set_time(t_ + h_);
    return rows.trouble().empty();
  }
  void forget() {
    std::fill(lambda_.begin(), lambda_.end(), T(0.0));
    for (auto& r : rotations_.all) r.lambda = T(0.0);
  }
  Outcome give_up(Outcome o) {
    forget();
    return m_ > 0 ? manifold_->rows().give_up(o) : o;
  }

  // --- the iteration ----------------------------------------------------------------------------
  /// first_ = (q, p½), second_ = (q', p½) and the multipliers, in sweeps to stagnation.
  Outcome iterate() {
    first_ = start_;
    kick();
    second_ = first_;
    return sweep_to_end(end_, options_.max_sweeps, [&](SweepMoves& moves) {
      field(t_, first_, f_first_);
      field(t_ + h_, second_, f_second_);
      ++cost_.sweeps;
      return move(moves);
    });
  }
  /// (∂pH, -∂qH), with the term of the quaternions.
  void field(T t, const std::vector<T>& x, std::vector<T>& f) {
    system_->field(t, x, {}, f);
    ++cost_.evaluations;
    rotations_.add_to_field(x, f);
  }
  /// Takes q', the multipliers that it asks for, and p½ from the fields. @return whether they are
  /// finite
  bool move(SweepMoves& moves) {
    const T half = T(0.5) * h_;
    double total = 0;
    const auto take = [&](size_t k, T& own, const T& to) {
      sizes_.count(k, magnitude(to - own), moves);
      total += magnitude(to);
      own = to;
    };
    measure_sizes();
    for (size_t k = 0; k < n_; ++k)
      take(k, second_[k], start_[k] + half * (f_first_[k] + f_second_[k]));
    correct_multipliers();
    for (size_t k = n_; k < 2 * n_; ++k) first_[k] = start_[k] + half * f_first_[k];
    kick();
    for (size_t k = n_; k < 2 * n_; ++k) take(k, second_[k], first_[k]);
    return std::isfinite(total);
  }
  void measure_sizes() {
    for (size_t k = 0; k < 2 * n_; ++k)
      sizes_.measure(k, start_[k], magnitude(second_[k] - start_[k]));
    sizes_.settle();
  }
  /// q' answers λ by -(h²/2) D, and |ξ'|² its own multiplier by -h²κ, to leading order.
  void correct_multipliers() {
    for (auto& r : rotations_.all) r.lambda += rotations_.excess(r, second_) / (h_ * h_ * r.kappa);
    if (m_ == 0) return;
    rows_after_->place(second_, g_);
    manifold_->rows()->solve(g_);
    for (const size_t r : manifold_->rows().active())
      lambda_[r] = lambda_[r] + T(2.0) * g_[r] / (h_ * h_);
  }
  /// The first kick of the multipliers, on the momenta of first_.
  void kick() {
    const T half = T(0.5) * h_;
    for (const auto& r : rotations_.all)
      for (size_t k = 0; k < 4; ++k)
        first_[n_ + r.q + k] = first_[n_ + r.q + k] - half * r.lambda * start_[r.q + k];
    if (m_ == 0) return;
    manifold_->rows()->forces(lambda_, push_);
    for (size_t k = n_; k < 2 * n_; ++k) first_[k] = first_[k] - half * push_[k];
  }

  // --- the end of the step -----------------------------------------------------------------------
  /// Leaves the state as it was unless the end is finite.
  Outcome finish(State& s) {
    before_ = s.x;
    before_lo_ = s.lo;
    const T half = T(0.5) * h_;
    for (size_t k = 0; k < 2 * n_; ++k)
      phs::compensated_add(s.x[k], s.lo[k], half * (f_first_[k] + f_second_[k]));
    for (const auto& r : rotations_.all)
      for (size_t k = 0; k < 4; ++k)
        add_to_momentum(s, r.q + k, -half * r.lambda * start_[r.q + k]);
    for (size_t k = 0; m_ > 0 && k < n_; ++k) add_to_momentum(s, k, -half * push_[n_ + k]);
    double total = settle_quaternions(s);
    if (m_ > 0) {
      std::swap(first_slip_, slip_);
      manifold_->bring_momenta_back(t_ + h_, s, last_impulse_);
      std::copy(manifold_->slip().begin(), manifold_->slip().end(), slip_.begin());
      for (const T& slip : slip_) total += magnitude(slip);
    }
    if (!std::isfinite(total)) {
      s.x = before_;
      s.lo = before_lo_;
      return Outcome::not_finite;
    }
    if (port_work_.any()) book();
    return Outcome::ok;
  }
  void add_to_momentum(State& s, size_t k, const T& change) {
    phs::compensated_add(s.x[n_ + k], s.lo[n_ + k], change);
  }
  /// The second kick of a quaternion makes ξ'·π' = 0. @return a sum that is finite if all is
  double settle_quaternions(State& s) {
    double total = 0;
    for (const auto& r : rotations_.all) {
      const T along = rotations_.dot(r, s.x, s.x) + rotations_.dot(r, s.x, s.lo);
      const T mu = along / (T(1.0) + rotations_.excess(r, s.x));
      for (size_t k = 0; k < 4; ++k) add_to_momentum(s, r.q + k, -mu * s.x[r.q + k]);
      total += magnitude(mu);
    }
    return total;
  }

  /// The powers at both ends, with p½; the reactions there; what moving rows put in.
  void book() {
    const T half = T(0.5) * h_;
    port_work_.restart();
    if (has_powers_) {
      port_work_.add(*system_, t_, half, first_, f_first_);
      port_work_.add(*system_, t_ + h_, half, second_, f_second_);
    }
    for (const auto& block : system_->description().constraints) {
      if (block.power < 0) continue;
      T work(0.0);
      for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r) {
        const T first = half * lambda_[r], &last = last_impulse_[r];
        work = work - first * first_slip_[r] - last * slip_[r];
        if (block.moving) work = work + first * first_drift_[r] + last * manifold_->drift()[r];
      }
      port_work_.add(size_t(block.power), work);
    }
  }

  size_t n_;  ///< numbers in q
  size_t m_;  ///< rows
  UnitQuaternions<T> rotations_;
  StateSizes<T> sizes_;
  TurnKeeper<T> keeper_;
  SweepEnd end_;
  std::optional<Manifold<T>> manifold_;              ///< at the start, then at the end of the step
  std::unique_ptr<phs::Constraints<T>> rows_after_;  ///< at q'
  T t_ = T(0.0), h_ = T(0.0);
  bool has_powers_ = false;  ///< besides those of constraints
  std::vector<T> start_, before_, before_lo_;
  std::vector<T> first_, second_, f_first_, f_second_, push_;
  std::vector<T> lambda_, g_, last_impulse_;
  std::vector<T> first_slip_, first_drift_, slip_;  ///< Bᵀe + ∂g/∂t and ∂g/∂t at the ends
};

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_rattle(const Declaration& d, const phs::Model& model, T h,
                                                const Options& o) {
  return std::make_unique<Rattle<T>>(d, model, h, o);
}

}  // namespace

Entries rattle_entries() {
  return {entry({.name = "rattle",
                 .title = "generalised RATTLE: Stormer-Verlet with constraints",
                 .family = "RATTLE, for constraints",
                 .order = 2,
                 .symmetric = Claim::holds,
                 .symplectic = Claim::holds,
                 .constraints = true,
                 .needs = {.canonical = true, .lossless = true},
                 .source = "Hairer, Lubich, Wanner 2006, VII.1.4"},
                PORTHOS_MAKER(make_rattle))};
}

}  // namespace porthos::integrators
