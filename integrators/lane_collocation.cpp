#include "integrators/lane_collocation.h"

#include <algorithm>
#include <cmath>

#include "integrators/collocation.h"
#include "integrators/newton.h"
#include "integrators/stagnation.h"

namespace porthos::integrators {
namespace {

class LaneCollocation final : public LaneIntegrator {
  using Stages = std::vector<std::vector<Lanes>>;  ///< [stage][state number]

 public:
  LaneCollocation(const Declaration& d, const CollocationTable<double>& t, const phs::Model& model,
                  double h, const Options& o)
      : LaneIntegrator(model, h, o),
        s_(size_t(t.s)),
        momenta_(t.mu_p.empty() ? n_ : n_ / 2),
        mu_(t.mu),
        mu_p_(t.mu_p.empty() ? t.mu : t.mu_p),
        hb_(s_),
        nu_(s_ * s_),
        memory_(make_collocation<double>(d, t, model, h, o)->memory()),
        with_newton_(memory_.size() > distrust_at() + 1),
        Y_(s_, std::vector<Lanes>(n_, Lanes(0.0))),
        L_(Y_),
        L_before_(Y_),
        F_(works_at_work_.any() ? n_ : 0),
        smallest_(n_, Lanes(HUGE_VAL)),
        lane_(size_t(width), Lane(o.iteration_tolerance)) {
    t.weights(h, hb_);
    std::vector<double> B(s_);
    for (size_t i = 0; i < s_; ++i) {
      ch_.push_back(h * t.c[i]);
      t.polynomial(1 + 1.0 * t.c[i], B);
      for (size_t j = 0; j < s_; ++j) nu_[i * s_ + j] = B[j] - 1;
    }
  }

  std::vector<double> memory(int lane) const override {
    const Lane& l = lane_[size_t(lane)];
    std::vector<double> m = memory_;
    m[0] = l.have_before, m[1] = l.have_before ? h_ : 0.0;
    for (size_t k = 0; k < n_; ++k)
      for (size_t i = 0; i < s_; ++i) m[2 + k * s_ + i] = L_before_[i][k][lane];
    const size_t at = distrust_at();
    m[at] = l.distrust;
    if (with_newton_) {
      std::vector<double> choice;
      l.choice.save(choice);
      std::copy(choice.begin(), choice.end(), m.begin() + long(at) + 2);
    }
    return m;
  }

 private:
  /// The iteration of one lane, as StepSolver and iterate() have it.
  struct Lane {
    explicit Lane(double tolerance) : stagnation(Stagnation::of<double>(tolerance)) {}
    Stagnation stagnation;
    SolverChoice choice;
    bool have_before = false, predicted = false, dropped = false;
    int distrust = 0;  ///< as it is before the step at work
    int sweeps = 0;
    bool finishing = false;  ///< stagnated: the next evaluation is the last
  };
  size_t distrust_at() const { return 2 + n_ * s_; }

  void forget(Set lanes) override {
    for_each_lane(lanes, [&](int i) {
      Lane& l = lane_[size_t(i)];
      l.have_before = false, l.distrust = 0, l.choice = SolverChoice();
    });
    stand(lanes);
  }
  /// Puts stages where the field is finite.
  void stand(Set lanes) {
    const auto now = mask_of<Lanes>(lanes);
    for (auto& Y : Y_)
      for (size_t k = 0; k < n_; ++k) Y[k] = select(now, x_[k] + lo_[k], Y[k]);
  }

  Set begin(Set lanes) override {
    Set predicted = 0, newton = 0;
    for_each_lane(lanes, [&](int i) {
      Lane& l = lane_[size_t(i)];
      if (l.choice.newton()) newton |= lane_bit(i);
      l.predicted = l.have_before && l.distrust == 0;
      l.sweeps = 0, l.dropped = l.finishing = false;
      if (l.predicted) predicted |= lane_bit(i);
    });
    guess(lanes & ~newton, predicted);
    return newton;
  }

  /// First values of the stages: extrapolated, or the state.
  void guess(Set lanes, Set predicted) {
    for_each_lane(lanes, [&](int i) { lane_[size_t(i)].stagnation.restart(); });
    const auto all = mask_of<Lanes>(lanes), with = mask_of<Lanes>(predicted);
    for (size_t k = 0; k < n_; ++k) {
      const Lanes here = x_[k] + lo_[k];
      for (size_t i = 0; i < s_; ++i) {
        const Lanes Y =
            predicted ? select(with, stage_value(k, &nu_[i * s_], L_before_), here) : here;
        Y_[i][k] = select(all, Y, Y_[i][k]);
      }
      smallest_[k] = select(all, Lanes(HUGE_VAL), smallest_[k]);
    }
  }
  Lanes stage_value(size_t k, const double* coefficients, const Stages& L) const {
    Lanes sum(0.0);
    for (size_t j = 0; j < s_; ++j) sum += Lanes(coefficients[j]) * L[j][k];
    return x_[k] + (lo_[k] + sum);
  }

  /// One evaluation of every stage of every lane: a sweep for those that iterate, the last one for those that have
  /// stagnated.
  Ended round(Set lanes) override {
    for (size_t i = 0; i < s_; ++i) {
      system_->field(t_ + Lanes(ch_[i]), Y_[i], {}, L_[i]);
      for (size_t k = 0; k < n_; ++k) L_[i][k] = Lanes(hb_[i]) * L_[i][k];
    }
    Ended e;
    for_each_lane(lanes, [&](int i) {
      if (lane_[size_t(i)].finishing) e.done |= lane_bit(i);
    });
    if (const Set sweeping = lanes & ~e.done) sweep(sweeping, e);
    if (e.failed()) stand(e.failed());
    if (e.done) finish(e.done);
    return e;
  }

  void sweep(Set sweeping, Ended& e) {
    const auto now = mask_of<Lanes>(sweeping);
    Lanes largest(0.0), total(0.0), change(0.0), distance(0.0), changed(0.0), improved(0.0);
    const Lanes one(1.0), zero(0.0);
    for (size_t k = 0; k < n_; ++k) largest = phs::max(largest, phs::abs(x_[k]));
    const Lanes least = phs::max(Lanes(1e-4) * largest, Lanes(1e-300));
    for (size_t k = 0; k < n_; ++k) {
      Lanes move(0.0), away(0.0);
      const auto& mu = k < momenta_ ? mu_ : mu_p_;
      for (size_t i = 0; i < s_; ++i) {
        const Lanes Y = stage_value(k, &mu[i * s_], L_);
        const Lanes by = phs::abs(Y - Y_[i][k]);
        move = phs::max(move, by), total += by;
        away = phs::max(away, phs::abs(Y - x_[k]));
        Y_[i][k] = select(now, Y, Y_[i][k]);
      }
      const auto moved = move > zero, record = moved & (move < smallest_[k]);
      changed = select(moved, one, changed), improved = select(record, one, improved);
      smallest_[k] = select(record, move, smallest_[k]);
      const Lanes size = phs::max(phs::max(phs::abs(x_[k]), away), least);
      change = phs::max(change, move / size), distance = phs::max(distance, away / size);
    }
    Set again = 0;
    for_each_lane(sweeping, [&](int i) {
      Lane& l = lane_[size_t(i)];
      ++l.sweeps;
      const Sweep s{.finite = total[i] < HUGE_VAL,
                    .changed = changed[i] != 0,
                    .improved = improved[i] != 0,
                    .change = change[i]};
      if (l.sweeps == 1 && l.predicted && s.finite && s.change > distance[i]) {
        l.dropped = true, again |= lane_bit(i);
        if (l.sweeps == options_.max_sweeps) run_out(i, e);
        return;
      }
      using enum Stagnation::Verdict;
      const auto verdict = l.stagnation.after(s);
      if (verdict == go_on && l.stagnation.wants_noise()) l.stagnation.set_noise(0);
      if (verdict == not_finite || verdict == diverges)
        e.not_converged |= lane_bit(i);
      else if (verdict == exact)
        e.done |= lane_bit(i);
      else if (verdict == stagnated)
        l.finishing = true;
      else if (l.sweeps == options_.max_sweeps)
        run_out(i, e);
    });
    if (again) guess(again, 0);
  }
  /// Of sweeps: good enough if only noise is left, unless Newton goes further.
  void run_out(int lane, Ended& e) {
    Lane& l = lane_[size_t(lane)];
    if (l.stagnation.settled() && !with_newton_)
      l.finishing = true;
    else
      e.not_converged |= lane_bit(lane);
  }

  void finish(Set done) {
    if (works_at_work_.any()) book();
    const auto m = mask_of<Lanes>(done);
    const auto add = [&](size_t k, Lanes move) {
      Lanes x = x_[k], lo = lo_[k];
      phs::compensated_add(x, lo, move);
      x_[k] = select(m, x, x_[k]), lo_[k] = select(m, lo, lo_[k]);
    };
    for (size_t k = 0; k < n_; ++k) {
      Lanes sum(0.0);  // outer pairs first, as in collocation.cpp
      for (size_t i = 0; i < s_ / 2; ++i) sum += L_[i][k] + L_[s_ - 1 - i][k];
      add(k, s_ % 2 ? sum + L_[s_ / 2][k] : sum);
      for (size_t i = 0; i < s_; ++i) L_before_[i][k] = select(m, L_[i][k], L_before_[i][k]);
    }
    for_each_lane(done, [&](int i) {
      Lane& l = lane_[size_t(i)];
      l.have_before = true;
      l.distrust = l.dropped ? 16 : std::max(l.distrust - 1, 0);
      if (with_newton_) l.choice.fixed_point_was(true, l.sweeps);
    });
  }
  void book() {
    works_at_work_.restart();
    for (size_t i = 0; i < s_; ++i) {
      const Lanes t = t_ + Lanes(ch_[i]), hb(hb_[i]);
      for (size_t k = 0; k < n_; ++k) F_[k] = L_[i][k] / hb;
      works_at_work_.add(*system_, t, hb, Y_[i], F_);
    }
  }

  size_t s_, momenta_;
  std::vector<double> mu_, mu_p_, hb_, ch_, nu_;
  std::vector<double> memory_;  ///< of an integrator before its first step
  bool with_newton_;
  Stages Y_, L_, L_before_;
  std::vector<Lanes> F_, smallest_;
  std::vector<Lane> lane_;
};

}  // namespace

std::unique_ptr<LaneIntegrator> make_lane_collocation(const Declaration& d,
                                                      const CollocationTable<double>& table,
                                                      const phs::Model& model, double h,
                                                      const Options& o) {
  if (o.solver != Solver::automatic && o.solver != Solver::fixed_point) return nullptr;
  return std::make_unique<LaneCollocation>(d, table, model, h, o);
}

}  // namespace porthos::integrators
