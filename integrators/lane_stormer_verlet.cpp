#include <algorithm>
#include <cmath>

#include "integrators/stagnation.h"
#include "integrators/stormer_verlet.h"

namespace porthos::integrators {
namespace {

/// The step of stormer_verlet.cpp for a state per lane: the same operations in the same order, each lane with its own end of
/// the iteration.
class LaneStormerVerlet final : public LaneIntegrator {
  struct Rotation {
    size_t q;
    Lanes kappa = Lanes(0.0), lambda = Lanes(0.0), lambda_before = Lanes(0.0);
  };

 public:
  LaneStormerVerlet(const phs::Model& model, double h, const Options& o)
      : LaneIntegrator(model, h, o),
        m_(n_ / 2),
        start_(n_, Lanes(0.0)),
        x0_(start_),
        x1_(start_),
        f0_(start_),
        f1_(start_),
        stagnation_(size_t(width), Stagnation::of<double>(o.iteration_tolerance)),
        sweeps_(size_t(width)) {
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::rotation) rotations_.push_back({size_t(b.at)});
    scale_rotations();
  }

  std::vector<double> memory(int lane) const override {
    std::vector<double> m;
    for (const auto& r : rotations_) m.push_back(r.lambda_before[lane]);
    return m;
  }

 private:
  void forget(int lane) override {
    for (auto& r : rotations_) r.lambda.set(lane, 0.0);
    stand(lane);
  }
  /// Puts a lane where the field is finite.
  void stand(int lane) {
    for (size_t i = 0; i < n_; ++i) {
      const double x = x_[i][lane] + lo_[i][lane];
      start_[i].set(lane, x), x0_[i].set(lane, x), x1_[i].set(lane, x);
    }
  }

  void begin(Set lanes) override {
    const auto m = mask(lanes);
    for (size_t i = 0; i < n_; ++i) {
      start_[i] = select(m, x_[i] + lo_[i], start_[i]);
      x0_[i] = select(m, start_[i], x0_[i]), x1_[i] = select(m, start_[i], x1_[i]);
    }
    for (auto& r : rotations_) r.lambda_before = select(m, r.lambda, r.lambda_before);
    for (int l = 0; l < width; ++l)
      if (lanes & bit(l)) {
        run_[size_t(l)].phase = Phase::sweeping;
        stagnation_[size_t(l)].restart(), sweeps_[size_t(l)] = 0;
      }
  }

  void advance() override {
    const Set sweeping = in(Phase::sweeping);
    const auto now = mask(sweeping);
    field(t_, x0_, f0_), field(t_ + Lanes(h_), x1_, f1_);
    for (const auto& r : rotations_)
      for (size_t k = 0; k < 4; ++k)
        f0_[m_ + r.q + k] = f0_[m_ + r.q + k] - r.lambda * start_[r.q + k];
    const Lanes half_h = Lanes(0.5) * Lanes(h_);
    Lanes change(0.0), size(0.0);
    for (size_t i = 0; i < m_; ++i) {
      const Lanes p_half = start_[m_ + i] + half_h * f0_[m_ + i];
      const Lanes q_next = start_[i] + half_h * (f0_[i] + f1_[i]);
      const Lanes moves = phs::abs(p_half - x0_[m_ + i]) + phs::abs(q_next - x1_[i]);
      change = select(moves <= change, change, moves);
      size = phs::max(phs::max(size, phs::abs(p_half)), phs::abs(q_next));
      x0_[m_ + i] = select(now, p_half, x0_[m_ + i]);
      x1_[m_ + i] = select(now, p_half, x1_[m_ + i]), x1_[i] = select(now, q_next, x1_[i]);
    }
    for (auto& r : rotations_) {
      Lanes excess(-1.0);
      for (size_t k = 0; k < 4; ++k) excess += x1_[r.q + k] * x1_[r.q + k];
      const Lanes d = excess / (Lanes(h_ * h_) * r.kappa);
      r.lambda = select(now, r.lambda + d, r.lambda);
      for (size_t k = 0; k < 4; ++k) {
        const Lanes kick = half_h * d * start_[r.q + k];
        Lanes &p0 = x0_[m_ + r.q + k], &p1 = x1_[m_ + r.q + k], &q1 = x1_[r.q + k];
        p0 = select(now, p0 - kick, p0), p1 = select(now, p1 - kick, p1);
        q1 = select(now, q1 - Lanes(h_) * r.kappa * kick, q1);
      }
    }
    Set solved = 0;
    for (int l = 0; l < width; ++l) {
      if (!(sweeping & bit(l))) continue;
      using enum Stagnation::Verdict;
      Stagnation& s = stagnation_[size_t(l)];
      const auto verdict = s.after({.finite = change[l]<HUGE_VAL, .changed = change[l]> 0,
                                    .improved = false,
                                    .change = change[l] / std::max(size[l], 1e-300)});
      const bool last = ++sweeps_[size_t(l)] == options_.max_sweeps;
      if (verdict == not_finite || verdict == diverges ||
          (verdict == go_on && last && !s.settled()))
        run_[size_t(l)].phase = Phase::stuck, stand(l);
      else if (verdict != go_on || last)
        solved |= bit(l);
    }
    if (solved) finish(solved);
  }

  void finish(Set solved) {
    const Lanes half_h = Lanes(0.5) * Lanes(h_);
    for (const auto& r : rotations_) {
      Lanes along(0.0), norm2(0.0);
      for (size_t k = 0; k < 4; ++k) {
        const size_t i = m_ + r.q + k;
        along += x1_[r.q + k] * (start_[i] + half_h * (f0_[i] + f1_[i]));
        norm2 += x1_[r.q + k] * x1_[r.q + k];
      }
      const Lanes mu = Lanes(2.0) * along / (Lanes(h_) * norm2);
      for (size_t k = 0; k < 4; ++k) f1_[m_ + r.q + k] = f1_[m_ + r.q + k] - mu * x1_[r.q + k];
    }
    for (size_t i = 0; i < n_; ++i) add(solved, i, half_h * (f0_[i] + f1_[i]));
    finished(solved);
  }

  void field(Lanes t, const std::vector<Lanes>& x, std::vector<Lanes>& f) {
    system_->field(t, x, {}, f);
    for (const auto& r : rotations_) {
      Lanes along(0.0);
      for (size_t k = 0; k < 4; ++k) along += x[r.q + k] * x[m_ + r.q + k];
      for (size_t k = 0; k < 4; ++k) {
        f[r.q + k] += r.kappa * along * x[r.q + k];
        f[m_ + r.q + k] = f[m_ + r.q + k] - r.kappa * along * x[m_ + r.q + k];
      }
    }
  }
  void scale_rotations() {
    for (const auto& r : rotations_) x0_[r.q] = Lanes(1.0);
    for (auto& r : rotations_)
      for (size_t k = 1; k < 4; ++k) {
        x0_[m_ + r.q + k] = Lanes(1.0);
        system_->field(Lanes(0.0), x0_, {}, f0_);
        x0_[m_ + r.q + k] = Lanes(0.0);
        r.kappa += f0_[r.q + k] / Lanes(3.0);
      }
  }

  size_t m_;  ///< numbers in q
  std::vector<Lanes> start_, x0_, x1_, f0_, f1_;
  std::vector<Rotation> rotations_;
  std::vector<Stagnation> stagnation_;
  std::vector<int> sweeps_;
};

}  // namespace

std::unique_ptr<LaneIntegrator> make_lane_stormer_verlet(const phs::Model& model, double h,
                                                         const Options& o) {
  const auto& d = model.description();
  const bool books = o.books && !d.powers.empty();  // of its own it keeps none: one state at a time
  return d.traits.separable || books ? nullptr : std::make_unique<LaneStormerVerlet>(model, h, o);
}

}  // namespace porthos::integrators
