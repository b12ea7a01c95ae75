#include "integrators/stormer_verlet.h"

#include <algorithm>
#include <cmath>

#include "integrators/catalogue.h"
#include "integrators/splitting.h"
#include "integrators/stagnation.h"

namespace porthos::integrators {
namespace {

template <class T>
class StormerVerlet final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::options_, Base::system_;
  using typename Base::State;

  /// A quaternion block and its multiplier.
  struct Rotation {
    size_t q;  ///< offset of ξ in q; π stands at the same place in p
    T kappa = T(0.0);
    T lambda = T(0.0);  ///< multiplier of the first kick, kept as the next start value
  };

 public:
  StormerVerlet(const Declaration& d, const phs::Model& model, T h, const Options& o)
      : Base(d, model, h, o),
        n_(Base::n_ / 2),
        stagnation_(Stagnation::of<T>(o.iteration_tolerance)),
        start_(2 * n_),
        x0_(2 * n_),
        x1_(2 * n_),
        f0_(2 * n_),
        f1_(2 * n_) {
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::rotation) rotations_.push_back({size_t(b.at)});
    scale_rotations();
  }

  Outcome advance(T t, T h, State& s) override {
    t_ = t, h_ = h;
    for (size_t i = 0; i < 2 * n_; ++i) start_[i] = s.x[i] + s.lo[i];

    const Outcome o = solve();
    if (o != Outcome::ok) {
      for (auto& r : rotations_) r.lambda = T(0.0);  // the next step starts afresh
      return o;
    }
    finish();
    for (size_t i = 0; i < 2 * n_; ++i)
      phs::compensated_add(s.x[i], s.lo[i], T(0.5) * h_ * (f0_[i] + f1_[i]));
    return Outcome::ok;
  }

  void save(std::vector<double>& m) const override {
    for (const auto& r : rotations_) m.push_back(phs::to_double(r.lambda));
  }
  void restore(std::span<const double> m) override {
    require_size("memory of Stormer-Verlet", m.size(), rotations_.size());
    for (size_t i = 0; i < rotations_.size(); ++i) rotations_[i].lambda = T(m[i]);
  }

 private:
  /// x0 = (q, p½), x1 = (q', p½): fixed-point sweeps on p½, q' and the multipliers together, to stagnation.
  Outcome solve() {
    x0_ = start_, x1_ = start_;
    stagnation_.restart();
    for (int sweep = 1; sweep <= options_.max_sweeps; ++sweep) {
      field(t_, x0_, f0_), field(t_ + h_, x1_, f1_);  // time moves with q
      ++cost_.sweeps;
      for (const auto& r : rotations_)  // first kick carries -λ ξ
        for (size_t k = 0; k < 4; ++k) f0_[n_ + r.q + k] -= r.lambda * start_[r.q + k];

      double change = 0, size = 0;
      for (size_t i = 0; i < n_; ++i) {
        const T p_half = start_[n_ + i] + T(0.5) * h_ * f0_[n_ + i];
        const T q_next = start_[i] + T(0.5) * h_ * (f0_[i] + f1_[i]);
        const double moves = magnitude(p_half - x0_[n_ + i]) + magnitude(q_next - x1_[i]);
        if (!(moves <= change)) change = moves;
        size = std::max({size, magnitude(p_half), magnitude(q_next)});
        x0_[n_ + i] = x1_[n_ + i] = p_half;
        x1_[i] = q_next;
      }
      for (auto& r : rotations_) {
        T excess(-1.0);
        for (size_t k = 0; k < 4; ++k) excess += x1_[r.q + k] * x1_[r.q + k];
        // ∂|ξ'|²/∂λ = -h² κ to leading order. The move of λ is carried into p½ and q' at once: left to the next sweeps
        // it would arrive two sweeps late and the iteration would oscillate.
        const T d = excess / (h_ * h_ * r.kappa);
        r.lambda += d;
        for (size_t k = 0; k < 4; ++k) {
          const T kick = T(0.5) * h_ * d * start_[r.q + k];
          x0_[n_ + r.q + k] -= kick, x1_[n_ + r.q + k] -= kick;
          x1_[r.q + k] -= h_ * r.kappa * kick;
        }
      }
      using enum Stagnation::Verdict;
      const auto verdict = stagnation_.after({.finite = change<HUGE_VAL, .changed = change> 0,
                                              .improved = false,
                                              .change = change / std::max(size, 1e-300)});
      if (verdict == not_finite) return Outcome::not_finite;
      if (verdict == diverges) return Outcome::not_converged;
      if (verdict != go_on) return Outcome::ok;
    }
    return stagnation_.settled() ? Outcome::ok : Outcome::not_converged;
  }

  /// The second kick: f1 at (q', p½), with the multiplier that makes ξ'·π' = 0. It starts from the p½ that enters the
  /// state, ½h f0 away: the one of the last sweep differs along ξ by the rounding of λ, which has a factor 1/(hκ).
  void finish() {
    for (const auto& r : rotations_) {
      T along(0.0), norm2(0.0);
      for (size_t k = 0; k < 4; ++k) {
        const size_t i = n_ + r.q + k;
        along += x1_[r.q + k] * (start_[i] + T(0.5) * h_ * (f0_[i] + f1_[i]));
        norm2 += x1_[r.q + k] * x1_[r.q + k];
      }
      const T mu = T(2.0) * along / (h_ * norm2);
      for (size_t k = 0; k < 4; ++k) f1_[n_ + r.q + k] -= mu * x1_[r.q + k];
    }
  }

  /// (q', p') = (∂pH, -∂qH) of H + Σ (κ/2)(ξ·π)².
  void field(T t, const std::vector<T>& x, std::vector<T>& f) {
    system_->field(t, x, {}, f);
    ++cost_.evaluations;
    for (const auto& r : rotations_) {
      T along(0.0);
      for (size_t k = 0; k < 4; ++k) along += x[r.q + k] * x[n_ + r.q + k];
      for (size_t k = 0; k < 4; ++k) {
        f[r.q + k] += r.kappa * along * x[r.q + k];
        f[n_ + r.q + k] -= r.kappa * along * x[n_ + r.q + k];
      }
    }
  }

  /// κ from the field at the zero configuration, so that it belongs to the system and not to a state: ξ' = ½ ξ∘ω with
  /// ω = I⁻¹m, so at ξ = 1 the mean of π·ξ'/|π|² over π = i, j, k is a quarter of the mean inverse inertia.
  void scale_rotations() {
    std::vector<T>&x = x0_, &f = f0_;
    std::fill(x.begin(), x.end(), T(0.0));
    for (const auto& r : rotations_) x[r.q] = T(1.0);
    for (auto& r : rotations_) {
      for (size_t k = 1; k < 4; ++k) {
        x[n_ + r.q + k] = T(1.0);
        system_->field(T(0.0), x, {}, f);
        x[n_ + r.q + k] = T(0.0);
        r.kappa += f[r.q + k] / T(3.0);
      }
    }
  }

  T t_ = T(0.0), h_ = T(0.0);
  size_t n_;  ///< numbers in q
  Stagnation stagnation_;
  std::vector<T> start_, x0_, x1_, f0_, f1_;
  std::vector<Rotation> rotations_;
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_stormer_verlet(const Declaration& d,
                                                        const phs::Model& model, T h,
                                                        const Options& o) {
  const auto& system = model.description();
  const bool quaternions = std::ranges::any_of(
      system.blocks, [](const auto& b) { return b.kind == phs::BlockKind::rotation; });
  if (system.traits.separable && !quaternions) return make_kick_drift_kick<T>(d, model, h, o);
  return std::make_unique<StormerVerlet<T>>(d, model, h, o);
}
#define PORTHOS_INSTANTIATE(T)                                         \
  template std::unique_ptr<BasicIntegrator<T>> make_stormer_verlet<T>( \
      const Declaration&, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

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
                 [](const Declaration&, const phs::Model& m, double h, const Options& o) {
                   return make_lane_stormer_verlet(m, h, o);
                 })};
}

}  // namespace porthos::integrators
