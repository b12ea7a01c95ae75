#include "integrators/methods/stormer_verlet.h"

#include <algorithm>
#include <cmath>

#include "integrators/core/step_rule.h"
#include "integrators/methods/splitting.h"
#include "integrators/methods/staged_steps.h"
#include "integrators/methods/unit_quaternions.h"

namespace porthos::integrators {

template <class T>
class StormerVerlet {
 public:
  static constexpr bool integrates_power = false;
  explicit StormerVerlet(const Workplace<T>& w)
      : work_(w),
        n_(size_t(w.model.description().nx) / 2),
        start_(2 * n_, T(0.0)),
        x0_(start_),
        x1_(start_),
        f0_(start_),
        f1_(start_),
        rotations_(w.system),
        iteration_(phs::lanes<T>, {Stagnation::of<T>(w.options.iteration_tolerance)}) {}

  LaneSet begin(LaneSet lanes, const StepStart<T>& s) {
    stand(lanes, s);
    const auto now = mask_of<T>(lanes);
    for (auto& r : rotations_.all) r.lambda_before = select(now, r.lambda, r.lambda_before);
    for_each_lane(lanes, [&](int l) {
      iteration_[size_t(l)].stagnation.restart();
      iteration_[size_t(l)].sweeps = 0;
    });
    return 0;
  }

  /// x0 = (q, p½), x1 = (q', p½): fixed-point sweeps on p½, q' and the multipliers together, to
  /// stagnation.
  Ended round(LaneSet lanes, const StepStart<T>& s) {
    const auto now = mask_of_some<T>(lanes);
    const T half_h = T(0.5) * s.h;
    h_ = s.h;
    field(s.t, x0_, f0_);
    field(s.t + s.h, x1_, f1_);  // time moves with q
    ++work_.cost.sweeps;
    for (const auto& r : rotations_.all)  // first kick carries -λ ξ
      for (size_t k = 0; k < 4; ++k)
        f0_[n_ + r.q + k] = f0_[n_ + r.q + k] - r.lambda * start_[r.q + k];

    Size<T> change(0.0), size(0.0);
    for (size_t i = 0; i < n_; ++i) {
      T &p0 = x0_[n_ + i], &p1 = x1_[n_ + i], &q1 = x1_[i];
      const T p_half = start_[n_ + i] + half_h * f0_[n_ + i];
      const T q_next = start_[i] + half_h * (f0_[i] + f1_[i]);
      const Size<T> moves = magnitude(p_half - p0) + magnitude(q_next - q1);
      change = select(change > moves, change, moves);  // takes a NaN over
      size = phs::max(size, phs::max(magnitude(p_half), magnitude(q_next)));
      p0 = select(now, p_half, p0);
      p1 = select(now, p_half, p1);
      q1 = select(now, q_next, q1);
    }
    for (auto& r : rotations_.all) {
      // ∂|ξ'|²/∂λ = -h² κ to leading order. The change of λ is applied to p½ and q' at once.
      // Through the following sweeps it would act two sweeps late, and the iteration would
      // oscillate.
      const T d = rotations_.excess(r, x1_) / (s.h * s.h * r.kappa);
      r.lambda = select(now, r.lambda + d, r.lambda);
      for (size_t k = 0; k < 4; ++k) {
        const T kick = half_h * d * start_[r.q + k];
        T &p0 = x0_[n_ + r.q + k], &p1 = x1_[n_ + r.q + k], &q1 = x1_[r.q + k];
        p0 = select(now, p0 - kick, p0);
        p1 = select(now, p1 - kick, p1);
        q1 = select(now, q1 - s.h * r.kappa * kick, q1);
      }
    }

    Ended e;
    for_each_lane(lanes, [&](int l) { judge(l, in_lane(change, l), in_lane(size, l), e); });
    if (e.failed()) {
      const auto failed = mask_of<T>(e.failed());
      for (auto& r : rotations_.all) r.lambda = select(failed, r.lambda_before, r.lambda);
      stand(e.failed(), s);
    }
    if (e.done) finish();
    return e;
  }
  T move(size_t k) const { return T(0.5) * h_ * (f0_[k] + f1_[k]); }

  size_t multipliers() const { return rotations_.all.size(); }
  /// x0, x1, and the multipliers of the first kick.
  void stages(std::span<T> Y) const {
    std::copy(x0_.begin(), x0_.end(), Y.begin());
    std::copy(x1_.begin(), x1_.end(), Y.begin() + std::ptrdiff_t(2 * n_));
    for (size_t r = 0; r < multipliers(); ++r) Y[4 * n_ + r] = rotations_.all[r].lambda;
  }

  void forget(LaneSet lanes, const StepStart<T>& s) {
    const auto now = mask_of<T>(lanes);
    for (auto& r : rotations_.all) r.lambda = select(now, T(0.0), r.lambda);
    stand(lanes, s);
  }
  void carry(Archive& a, int lane) {
    for (auto& r : rotations_.all) carry_lane(a, r.lambda, lane);
  }

 private:
  struct LaneIteration {
    Stagnation stagnation;
    int sweeps = 0;
  };

  /// Sets the lanes to the start of their steps.
  void stand(LaneSet lanes, const StepStart<T>& s) {
    const auto now = mask_of<T>(lanes);
    for (size_t i = 0; i < 2 * n_; ++i) {
      start_[i] = select(now, s.x[i] + s.lo[i], start_[i]);
      x0_[i] = select(now, start_[i], x0_[i]);
      x1_[i] = select(now, start_[i], x1_[i]);
    }
  }

  /// Decides whether a lane's iteration ends with this sweep.
  void judge(int lane, double change, double size, Ended& e) {
    using enum Stagnation::Verdict;
    LaneIteration& i = iteration_[size_t(lane)];
    const auto verdict = i.stagnation.after({.finite = change<HUGE_VAL, .changed = change> 0,
                                             .improved = false,
                                             .change = change / std::max(size, 1e-300)});
    const bool last = ++i.sweeps >= work_.options.max_sweeps;
    if (verdict == go_on && !last) return;
    const bool solved = verdict == go_on ? i.stagnation.settled() : verdict != diverges;
    (verdict == not_finite ? e.not_finite : solved ? e.done : e.not_converged) |= lane_bit(lane);
  }

  /// The second kick: f1 at (q', p½), with the multiplier that makes ξ'·π' = 0. It starts from the
  /// p½ that enters the state, ½h f0 away. The p½ of the last sweep differs from it along ξ by the
  /// rounding of λ, which has a factor 1/(hκ).
  void finish() {
    for (const auto& r : rotations_.all) {
      T along(0.0), norm2(0.0);
      for (size_t k = 0; k < 4; ++k) {
        along += x1_[r.q + k] * (start_[n_ + r.q + k] + move(n_ + r.q + k));
        norm2 += x1_[r.q + k] * x1_[r.q + k];
      }
      const T mu = T(2.0) * along / (h_ * norm2);
      for (size_t k = 0; k < 4; ++k) f1_[n_ + r.q + k] = f1_[n_ + r.q + k] - mu * x1_[r.q + k];
    }
  }

  /// (q', p') = (∂pH, -∂qH) of H + Σ (κ/2)(ξ·π)².
  void field(T t, const std::vector<T>& x, std::vector<T>& f) {
    work_.system.field(t, x, {}, f);
    ++work_.cost.evaluations;
    rotations_.add_to_field(x, f);
  }

  Workplace<T> work_;
  size_t n_;  ///< numbers in q
  T h_ = T(0.0);
  std::vector<T> start_, x0_, x1_, f0_, f1_;
  UnitQuaternions<T> rotations_;
  std::vector<LaneIteration> iteration_;
};

namespace {

template <class T>
class StormerVerletSteps final : public OneState<StormerVerlet, T>, public StagedSteps<T> {
 public:
  using OneState<StormerVerlet, T>::OneState;
  CollocationTable<TableReal<T>> table() const override { return lobatto_table<TableReal<T>>(2); }
  void stages(const phs::BasicState<T>&, std::span<T> Y) const override { this->rule_.stages(Y); }
  size_t multipliers() const override { return this->rule_.multipliers(); }
};

/// The separable case without quaternions is explicit.
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_stormer_verlet(const Declaration& d,
                                                        const phs::Model& model, T h,
                                                        const Options& o) {
  const auto& system = model.description();
  const bool quaternions = std::ranges::any_of(
      system.blocks, [](const auto& b) { return b.kind == phs::BlockKind::rotation; });
  if (system.traits.separable && !quaternions) return make_kick_drift_kick<T>(d, model, h, o);
  return std::make_unique<StormerVerletSteps<T>>(d, model, h, o);
}
/// Null if H is separable or the system has powers to integrate.
std::unique_ptr<LaneIntegrator> make_stormer_verlet_lanes(const Declaration&,
                                                          const phs::Model& model, double h,
                                                          const Options& o) {
  const auto& d = model.description();
  const bool ledger =
      o.port_work && !d.powers.empty();  // the method has no ledger of its own: one state at a time
  if (d.traits.separable || ledger) return nullptr;
  return std::make_unique<StatePerLane<StormerVerlet<LaneIntegrator::Lanes>>>(model, h, o);
}

}  // namespace

Entries stormer_verlet_entries() {
  return {
      with_lanes(entry({.name = "stormer_verlet",
                        .title = "generalised Stormer-Verlet for mass that depends on q",
                        .family = "Partitioned",
                        .order = 2,
                        .symmetric = Claim::holds,
                        .symplectic = Claim::holds,
                        .needs = {.canonical = true, .lossless = true},
                        .source = "Hairer, Lubich, Wanner 2006, VI.3 (3.5); RATTLE multiplier on "
                                  "quaternions, VII.1.4"},
                       PORTHOS_MAKER(make_stormer_verlet)),
                 make_stormer_verlet_lanes)};
}

}  // namespace porthos::integrators
