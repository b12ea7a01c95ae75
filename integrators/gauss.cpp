#include "integrators/gauss.h"

#include <algorithm>
#include <cmath>

#include "integrators/turns.h"

namespace porthos::integrators {
namespace {

using phs::Pack;

/// The step for W lanes, s <= W stages; lanes beyond s repeat the last stage and carry no weight.
/// Stage data stand component by component, one lane per stage: Y[k] holds the k-th state number of all stages.
template <int W>
class Gauss final : public Integrator {
  using Lanes = Pack<double, W>;

 public:
  Gauss(Declaration d, const GaussTable<double>& t, const phs::Model& model, double h,
        const Options& o)
      : declaration_(std::move(d)),
        s_(t.s),
        n_(size_t(model.description().nx)),
        h_(h),
        options_(o),
        system_(model.instantiate<double>()),
        turns_(model.description()),
        lane_turns_(model.description()),
        Y_(n_),
        L_(n_),
        F_(n_),
        smallest_(n_),
        stage_(n_),
        rate_(n_),
        L_before_(n_, Lanes(0.0)) {
    if (o.lanes) lane_system_ = model.instantiate<Lanes>();
    const auto hb = t.weights(h);
    for (int i = 0; i < W; ++i) {
      const int r = std::min(i, s_ - 1);
      hb_.set(i, hb[size_t(r)]);
      ch_.set(i, h * t.c[size_t(r)]);
      for (int j = 0; j < s_; ++j) {
        mu_[j].set(i, t.mu[size_t(r * s_ + j)]);
        nu_[j].set(i, t.nu[size_t(r * s_ + j)]);
      }
    }
  }

  const Declaration& declaration() const override { return declaration_; }
  double step_size() const override { return h_; }

  Outcome step(phs::State& state) override {
    turns_.synchronise(state, *system_);
    if (lane_system_) lane_turns_.synchronise(state, *lane_system_);
    t_ = double(state.step) * h_;

    const Outcome o = solve(state);
    if (o != Outcome::ok) {
      have_before_ = false;
      return o;
    }
    for (size_t k = 0; k < n_; ++k)
      phs::compensated_add(state.x[k], state.lo[k], sum_of_stages(L_[k]));
    std::swap(L_, L_before_);
    have_before_ = true;
    ++state.step, ++cost_.steps;
    phs::wrap_angles(system_->description(), state);
    return Outcome::ok;
  }

  std::vector<double> memory() const override {
    std::vector<double> m{have_before_ ? 1.0 : 0.0, double(distrust_)};
    for (const auto& l : L_before_)
      for (int i = 0; i < s_; ++i) m.push_back(l[i]);
    return m;
  }
  void restore(std::span<const double> m) override {
    require_size("memory of the Gauss method", m.size(), 2 + n_ * size_t(s_));
    have_before_ = m[0] != 0, distrust_ = int(m[1]);
    for (size_t k = 0; k < n_; ++k)
      for (int i = 0; i < W; ++i)
        L_before_[k].set(i, m[2 + k * size_t(s_) + size_t(std::min(i, s_ - 1))]);
  }

 private:
  /// Fixed-point sweeps to stagnation. A tolerance would stop on one side of the solution and bias the energy.
  ///
  /// The sweeps go on while some component still moves less than ever before; one sweep of grace, then they stop. With
  /// many components one or another sets a record in its noise for long, so four sweeps without a record of the largest
  /// move end it too. None of this counts above `settled`: there a contraction that oscillates needs patience, and a
  /// pause is no solution.
  Outcome solve(const phs::State& state) {
    static constexpr double settled = 1e-11;
    bool predicted = have_before_ && distrust_ == 0;
    if (distrust_ > 0) --distrust_;
    start(state, predicted);

    double smallest_change = HUGE_VAL;
    int since_record = 0, grace = 1;
    for (int sweep = 1; sweep <= options_.max_sweeps; ++sweep) {
      const Progress p = sweep_once(state);
      if (!p.finite) return Outcome::not_finite;
      if (sweep == 1 && predicted && p.change > p.distance) {
        // The extrapolation was further off than no prediction at all: drop it for a while.
        predicted = false, distrust_ = 16;
        start(state, false);
        continue;
      }
      if (!p.changed) return Outcome::ok;  // an exact fixed point: L belongs to Y
      since_record = p.change < smallest_change ? 0 : since_record + 1;
      smallest_change = std::min(smallest_change, p.change);
      if (p.change > settled) {
        if (since_record > 10 || p.change > 1e6 * smallest_change) return Outcome::not_converged;
        continue;
      }
      grace = p.improved ? 1 : grace - 1;
      if (grace < 0 || since_record >= 4 || sweep == options_.max_sweeps) {
        evaluate();
        return Outcome::ok;
      }
    }
    return Outcome::not_converged;
  }

  void start(const phs::State& state, bool predicted) {
    predicted ? start_from_extrapolation(state) : start_from_constant(state);
    std::fill(smallest_.begin(), smallest_.end(), HUGE_VAL);
  }
  void start_from_constant(const phs::State& state) {
    for (size_t k = 0; k < n_; ++k) Y_[k] = Lanes(state.x[k]) + Lanes(state.lo[k]);
  }
  void start_from_extrapolation(const phs::State& state) {
    for (size_t k = 0; k < n_; ++k) Y_[k] = stage_values(state, k, nu_, L_before_[k]);
  }
  Lanes stage_values(const phs::State& state, size_t k, const Lanes* coefficients,
                     const Lanes& L) const {
    Lanes sum(0.0);
    for (int j = 0; j < s_; ++j) sum += coefficients[j] * Lanes(L[j]);
    return Lanes(state.x[k]) + (Lanes(state.lo[k]) + sum);
  }

  /// L_i = (h b_i) f(Y_i)
  void evaluate() {
    cost_.evaluations += s_, ++cost_.sweeps;
    if (lane_system_) {
      lane_system_->field(Lanes(t_) + ch_, Y_, {}, F_);
    } else {
      for (int i = 0; i < s_; ++i) {
        for (size_t k = 0; k < n_; ++k) stage_[k] = Y_[k][i];
        system_->field(t_ + ch_[i], stage_, {}, rate_);
        for (size_t k = 0; k < n_; ++k) F_[k].set(i, rate_[k]);
      }
      for (int i = s_; i < W; ++i)
        for (size_t k = 0; k < n_; ++k) F_[k].set(i, F_[k][s_ - 1]);
    }
    for (size_t k = 0; k < n_; ++k) L_[k] = hb_ * F_[k];
  }

  struct Progress {
    bool finite = true, changed = false, improved = false;
    double change =
        0;  ///< largest move of a stage value in this sweep, relative to its component's size
    double distance =
        0;  ///< largest distance of a stage value from the start of the step, likewise
  };

  Progress sweep_once(const phs::State& state) {
    evaluate();
    Progress p;
    double largest = 0;
    for (size_t k = 0; k < n_; ++k) largest = std::max(largest, std::fabs(state.x[k]));
    for (size_t k = 0; k < n_; ++k) {
      const Lanes Y = stage_values(state, k, mu_, L_[k]);
      const double move = largest_of(abs(Y - Y_[k])), away = largest_of(abs(Y - Lanes(state.x[k])));
      Y_[k] = Y;
      if (!(move < HUGE_VAL)) p.finite = false;
      if (move > 0) {
        p.changed = true;
        if (move < smallest_[k]) smallest_[k] = move, p.improved = true;
      }
      const double size = std::max({std::fabs(state.x[k]), away, 1e-4 * largest, 1e-300});
      p.change = std::max(p.change, move / size);
      p.distance = std::max(p.distance, away / size);
    }
    return p;
  }

  static double largest_of(const Lanes& x) {
    double r = x[0];
    for (int i = 1; i < W; ++i) r = x[i] > r || x[i] != x[i] ? x[i] : r;
    return r;
  }
  /// Σ L_i, outer pairs first as the weights are symmetric.
  double sum_of_stages(const Lanes& L) const {
    double sum = 0;
    for (int i = 0; i < s_ / 2; ++i) sum += L[i] + L[s_ - 1 - i];
    return s_ % 2 ? sum + L[s_ / 2] : sum;
  }

  Declaration declaration_;
  int s_;
  size_t n_;
  double h_, t_ = 0;
  Options options_;
  std::unique_ptr<phs::System<double>> system_;
  std::unique_ptr<phs::System<Lanes>> lane_system_;
  TurnKeeper<double> turns_;
  TurnKeeper<Lanes> lane_turns_;
  Lanes hb_, ch_, mu_[W], nu_[W];
  std::vector<Lanes> Y_, L_, F_;
  std::vector<double> smallest_, stage_, rate_;
  std::vector<Lanes> L_before_;
  bool have_before_ = false;
  int distrust_ = 0;  ///< steps left without extrapolation
};

}  // namespace

std::unique_ptr<Integrator> make_gauss(Declaration declaration, GaussTable<double> table,
                                       const phs::Model& model, double h, const Options& options) {
  if (table.s <= 4)
    return std::make_unique<Gauss<4>>(std::move(declaration), table, model, h, options);
  return std::make_unique<Gauss<8>>(std::move(declaration), table, model, h, options);
}
std::unique_ptr<Integrator> make_gauss(Declaration declaration, int s, const phs::Model& model,
                                       double h, const Options& options) {
  return make_gauss(std::move(declaration), gauss_table<double>(s), model, h, options);
}

std::vector<phs::Quad> gauss_reference(const phs::Model& model, std::vector<phs::Quad> x,
                                       phs::Quad h, std::int64_t steps, int s) {
  using phs::Quad;
  const auto table = gauss_table<Quad>(s);
  const auto hb = table.weights(h);
  const auto system = model.instantiate<Quad>();
  const size_t n = x.size(), S = size_t(s);
  std::vector<Quad> L(n * S, Quad(0)), before(n * S, Quad(0)), y(n), f(n);
  for (std::int64_t step = 0; step < steps; ++step) {
    Quad last = HUGE_VAL;
    for (size_t i = 0; i < S;
         ++i)  // extrapolated start, as increments expressed in the new step's L
      for (size_t k = 0; k < n; ++k) L[i * n + k] = before[i * n + k];
    for (int sweep = 0;; ++sweep) {
      Quad change = 0;
      std::vector<Quad> fresh(n * S);
      for (size_t i = 0; i < S; ++i) {
        for (size_t k = 0; k < n; ++k) {
          Quad sum = 0;
          const auto& m = sweep == 0 && step > 0 ? table.nu : table.mu;
          for (size_t j = 0; j < S; ++j) sum += m[i * S + j] * L[j * n + k];
          y[k] = x[k] + sum;
        }
        system->field((Quad(step) + table.c[i]) * h, y, {}, f);
        for (size_t k = 0; k < n; ++k) fresh[i * n + k] = hb[i] * f[k];
      }
      for (size_t j = 0; j < n * S; ++j) change = std::max(change, phs::abs(fresh[j] - L[j]));
      L.swap(fresh);
      if (change == 0 || (sweep > 3 && change >= last)) break;
      if (sweep > 200 || change != change)
        throw InvalidArgument("the 113-bit reference run does not converge at this step");
      last = change;
    }
    for (size_t k = 0; k < n; ++k) {
      Quad sum = 0;
      for (size_t i = 0; i < S; ++i) sum += L[i * n + k];
      x[k] += sum;
    }
    before = L;
  }
  return x;
}

}  // namespace porthos::integrators
