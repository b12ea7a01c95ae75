#include "integrators/stormer_verlet.h"

#include <algorithm>
#include <cmath>

#include "integrators/turns.h"

namespace porthos::integrators {
namespace {

class StormerVerlet final : public Integrator {
  /// A quaternion block and its multiplier.
  struct Rotation {
    size_t q;  ///< offset of ξ in q; π stands at the same place in p
    double kappa = 0;
    double lambda = 0;  ///< multiplier of the first kick, kept as the next start value
  };

 public:
  StormerVerlet(const Declaration& d, const phs::Model& model, double h, const Options& o)
      : declaration_(d),
        h_(h),
        options_(o),
        system_(model.instantiate<double>()),
        turns_(model.description()),
        n_(size_t(model.description().nx) / 2),
        start_(2 * n_),
        x0_(2 * n_),
        x1_(2 * n_),
        f0_(2 * n_),
        f1_(2 * n_) {
    const auto& traits = model.description().traits;
    if (!traits.canonical || !traits.lossless)
      throw InvalidArgument("method '" + d.name +
                            "' needs a canonical system without dissipation, '" +
                            model.description().name + "' is not one");
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::rotation) rotations_.push_back({size_t(b.at)});
    scale_rotations();
  }

  const Declaration& declaration() const override { return declaration_; }
  double step_size() const override { return h_; }

  Outcome step(phs::State& s) override {
    turns_.synchronise(s, *system_);
    t_ = double(s.step) * h_;
    for (size_t i = 0; i < 2 * n_; ++i) start_[i] = s.x[i] + s.lo[i];

    const Outcome o = solve();
    if (o != Outcome::ok) return o;
    finish();
    for (size_t i = 0; i < n_; ++i) {
      phs::compensated_add(s.x[i], s.lo[i], 0.5 * h_ * (f0_[i] + f1_[i]));
      phs::compensated_add(s.x[n_ + i], s.lo[n_ + i], 0.5 * h_ * (f0_[n_ + i] + f1_[n_ + i]));
    }
    ++s.step, ++cost_.steps;
    phs::wrap_angles(system_->description(), s);
    return Outcome::ok;
  }

  std::vector<double> memory() const override {
    std::vector<double> m;
    for (const auto& r : rotations_) m.push_back(r.lambda);
    return m;
  }
  void restore(std::span<const double> m) override {
    require_size("memory of Stormer-Verlet", m.size(), rotations_.size());
    for (size_t i = 0; i < rotations_.size(); ++i) rotations_[i].lambda = m[i];
  }

 private:
  /// x0 = (q, p½), x1 = (q', p½): fixed-point sweeps on p½, q' and the multipliers together, to stagnation.
  Outcome solve() {
    x0_ = start_, x1_ = start_;
    double smallest = HUGE_VAL;
    bool last_chance = false;
    for (int sweep = 1; sweep <= options_.max_sweeps; ++sweep) {
      field(x0_, f0_), field(x1_, f1_);
      ++cost_.sweeps;
      for (const auto& r : rotations_)  // first kick carries -λ ξ
        for (size_t k = 0; k < 4; ++k) f0_[n_ + r.q + k] -= r.lambda * start_[r.q + k];

      double change = 0, size = 0;
      for (size_t i = 0; i < n_; ++i) {
        const double p_half = start_[n_ + i] + 0.5 * h_ * f0_[n_ + i];
        const double q_next = start_[i] + 0.5 * h_ * (f0_[i] + f1_[i]);
        change = std::max({change, std::fabs(p_half - x0_[n_ + i]), std::fabs(q_next - x1_[i])});
        size = std::max({size, std::fabs(p_half), std::fabs(q_next)});
        x0_[n_ + i] = x1_[n_ + i] = p_half;
        x1_[i] = q_next;
      }
      for (auto& r : rotations_) {
        double excess = -1;
        for (size_t k = 0; k < 4; ++k) excess += x1_[r.q + k] * x1_[r.q + k];
        // ∂|ξ'|²/∂λ = -h² κ to leading order. The move of λ is carried into p½ and q' at once: left to the next sweeps
        // it would arrive two sweeps late and the iteration would oscillate.
        const double d = excess / (h_ * h_ * r.kappa);
        r.lambda += d;
        for (size_t k = 0; k < 4; ++k) {
          const double kick = 0.5 * h_ * d * start_[r.q + k];
          x0_[n_ + r.q + k] -= kick, x1_[n_ + r.q + k] -= kick;
          x1_[r.q + k] -= h_ * r.kappa * kick;
        }
      }
      if (!(change < HUGE_VAL)) return Outcome::not_finite;
      if (change < smallest) {
        smallest = change, last_chance = false;
      } else if (!last_chance) {
        last_chance = true;
      } else {
        return change <= 1e-10 * size ? Outcome::ok : Outcome::not_converged;
      }
      if (change == 0) return Outcome::ok;
    }
    return Outcome::not_converged;
  }

  /// The second kick: f1 at (q', p½), with the multiplier that makes ξ'·π' = 0.
  void finish() {
    for (const auto& r : rotations_) {
      double along = 0, norm2 = 0;
      for (size_t k = 0; k < 4; ++k) {
        along += x1_[r.q + k] * (x1_[n_ + r.q + k] + 0.5 * h_ * f1_[n_ + r.q + k]);
        norm2 += x1_[r.q + k] * x1_[r.q + k];
      }
      const double mu = 2 * along / (h_ * norm2);
      for (size_t k = 0; k < 4; ++k) f1_[n_ + r.q + k] -= mu * x1_[r.q + k];
    }
  }

  /// (q', p') = (∂pH, -∂qH) of H + Σ (κ/2)(ξ·π)².
  void field(const std::vector<double>& x, std::vector<double>& f) {
    system_->field(t_, x, {}, f);
    ++cost_.evaluations;
    for (const auto& r : rotations_) {
      double along = 0;
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
    std::vector<double>&x = x0_, &f = f0_;
    std::fill(x.begin(), x.end(), 0.0);
    for (const auto& r : rotations_) x[r.q] = 1;
    for (auto& r : rotations_) {
      for (size_t k = 1; k < 4; ++k) {
        x[n_ + r.q + k] = 1;
        system_->field(0, x, {}, f);
        x[n_ + r.q + k] = 0;
        r.kappa += f[r.q + k] / 3;
      }
    }
  }

  Declaration declaration_;
  double h_, t_ = 0;
  Options options_;
  std::unique_ptr<phs::System<double>> system_;
  TurnKeeper<double> turns_;
  size_t n_;
  std::vector<double> start_, x0_, x1_, f0_, f1_;
  std::vector<Rotation> rotations_;
};

}  // namespace

std::unique_ptr<Integrator> make_stormer_verlet(const Declaration& d, const phs::Model& model,
                                                double h, const Options& o) {
  return std::make_unique<StormerVerlet>(d, model, h, o);
}

}  // namespace porthos::integrators
