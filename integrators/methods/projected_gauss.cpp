#include "integrators/methods/projected_gauss.h"

#include <algorithm>
#include <optional>
#include <string>

#include "integrators/core/stage_constraints.h"
#include "integrators/core/stage_field.h"
#include "integrators/core/turns.h"
#include "integrators/methods/collocation_stages.h"
#include "integrators/methods/manifold.h"
#include "integrators/tables/inverse.h"

namespace porthos::integrators {
namespace {

/// With L_i = h b_i f(Y_i) - B(Y_i) I_i and the impulses I_i = h b_i λ_i:
///   Y_i = y + Σ_j μ_ij L_j,   B(Y_i)ᵀ e(Y_i) + ∂g/∂t = 0
///   y'  = y + Σ_i L_i, brought back to g = 0 and Bᵀe + ∂g/∂t = 0 (manifold.h)
/// The rates at the stages answer impulses by -μ ⊗ D, so a sweep corrects I by (μ⁻¹ ⊗ D⁻¹) of what
/// they miss. Order 2s of this index-2 collocation needs the projection.
/// Source: Ascher, Petzold 1991, SIAM J. Numer. Anal. 28:1097.
template <class T, int W>
class ProjectedGauss final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::options_, Base::system_, Base::port_work_;
  using typename Base::State;
  using Step = CollocationStages<T, W>;
  using Real = typename Step::Real;
  using Lanes = typename Step::Lanes;
  using Stages = typename Step::Stages;
  static constexpr int V = Step::V, chunks = W / V;

 public:
  ProjectedGauss(Declaration d, CollocationTable<Real> t, const phs::Model& model, T h,
                 const Options& o)
      : Base(std::move(d), model, h, o),
        m_(size_t(model.description().constraint_count())),
        step_(std::move(t), n_ + m_),
        field_(model, *system_, o.lanes),
        sizes_(model.description()),
        start_(n_ + m_, T(0.0)),
        start_lo_(start_),
        E_(n_),
        row_(m_, Lanes(T(0.0))),
        lambda_(row_),
        change_(m_ * size_t(step_.s), T(0.0)),
        impulse_(m_, T(0.0)),
        keeper_(model.description()),
        end_(unit_roundoff<T>, o.iteration_tolerance) {
    for (auto* a : {&f_, &F_, &slip_})
      for (auto& chunk : *a) chunk.assign(a == &slip_ ? m_ : n_, Lanes(T(0.0)));
    set_response();
    if (m_ == 0) return;
    manifold_.emplace(*system_, m_, cost_);
    for (auto& rows : rows_at_) rows = std::make_unique<StageConstraints<T, V>>(model, o.lanes);
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    field_.tell_turns(state.turns);
    if (m_ == 0) return;
    keeper_.when_changed(state.turns, [&](std::span<const T> angles) {
      manifold_->rows().set_turn_angles(angles);
      for (auto& rows : rows_at_) rows->set_turn_angles(angles);
    });
  }

  Outcome advance(T t, T h, State& state) override {
    t_ = t;
    step_.adapt_to(table_real(h), table_real(have_before_ ? h_before_ : h));
    std::copy_n(state.x.begin(), n_, start_.begin());
    std::copy_n(state.lo.begin(), n_, start_lo_.begin());
    const bool same_rows = m_ == 0 || manifold_->rows().choose(state.x);
    if (m_ > 0 && !manifold_->rows().trouble().empty()) return give_up(Outcome::singular);
    for (int c = 0; m_ > 0 && c < chunks && used(c) > 0; ++c)
      rows_at_[size_t(c)]->set_times(Lanes(t) + step_.ch[size_t(c)], used(c));
    Outcome o = Outcome::not_converged;
    if (have_before_ && same_rows) o = iterate(true);
    if (o != Outcome::ok) o = iterate(false);
    if (o != Outcome::ok) return give_up(o);
    o = finish(state, h);
    return o == Outcome::ok ? o : give_up(o);
  }

  void carry(Archive& a) override {
    a(have_before_);
    a(h_before_);
    step_.carry(a, 0);
    if (m_ > 0) manifold_->rows().carry(a);
  }
  std::string remark() const override { return m_ > 0 ? manifold_->rows().trouble() : ""; }
  bool integrates_power() const override { return true; }

 private:
  int used(int c) const { return std::clamp(step_.s - c * V, 0, V); }
  /// Those of a chunk without the multipliers.
  std::span<const Lanes> stages(int c) const {
    return std::span<const Lanes>(step_.Y[size_t(c)]).first(n_);
  }
  Outcome give_up(Outcome o) {
    have_before_ = false;
    return m_ > 0 ? manifold_->rows().give_up(o) : o;
  }
  /// μ⁻¹
  void set_response() {
    const size_t s = size_t(step_.s);
    std::vector<phs::Quad> mu;
    for (const phs::Quad x : gauss_table<phs::Quad>(step_.s).mu) mu.push_back(x);
    const auto inverse = inverse_of(s, mu);
    for (int lane = 0; lane < W; ++lane)
      for (size_t j = 0; j < s; ++j)
        response_[j][size_t(lane / V)].set(lane % V,
                                           T(Real(inverse[size_t(step_.row(lane)) * s + j])));
  }

  // --- the iteration ----------------------------------------------------------------------------
  /// The multipliers are m more numbers of the state: L[n …] holds I, so that they are predicted
  /// and carried like the rest.
  Outcome iterate(bool predicted) {
    step_.guess_slopes(predicted);
    std::fill(lambda_.begin(), lambda_.end(), Lanes(T(0.0)));
    const auto sweep = [&](SweepMoves& moves) {
      step_.renew(start_, Step::low_words(start_lo_));
      measure_sizes();
      evaluate();
      if (m_ > 0) correct_impulses();
      return take_slopes(moves);
    };
    SweepMoves from_guess;
    if (!sweep(from_guess)) return Outcome::not_finite;
    return sweep_to_end(end_, options_.max_sweeps, sweep);
  }
  void measure_sizes() {
    for (size_t k = 0; k < n_; ++k) {
      Magnitudes<V> away(0.0);
      for (int c = 0; c < chunks; ++c)
        away = max(away, magnitudes(step_.Y[size_t(c)][k] - Lanes(start_[k])));
      sizes_.measure(k, start_[k], largest_of(away));
    }
    sizes_.settle();
  }
  /// f and the slips at all stages.
  void evaluate() {
    cost_.evaluations += step_.s;
    ++cost_.sweeps;
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      field_.field(t_, step_.ch[size_t(c)], stages(c), f_[size_t(c)], used(c));
      if (m_ == 0) continue;
      auto& rows = *rows_at_[size_t(c)];
      rows.place(stages(c), row_, used(c));
      field_.efforts(t_, step_.ch[size_t(c)], stages(c), f_[size_t(c)], E_, used(c));
      rows.slips(E_, slip_[size_t(c)], used(c));
    }
  }
  /// I += (μ⁻¹ ⊗ D⁻¹) slip, in the rows in use; F = B I.
  void correct_impulses() {
    const auto& active = manifold_->rows().active();
    for (const size_t r : active)
      for (int c = 0; c < chunks; ++c) {
        Lanes sum(T(0.0));
        for (int j = 0; j < step_.s; ++j)
          sum += response_[size_t(j)][size_t(c)] * Lanes(Step::at(slip_, r, j));
        for (int i = 0; i < used(c); ++i) change_[size_t(c * V + i) * m_ + r] = sum[i];
      }
    for (int i = 0; i < step_.s; ++i) {
      const auto of_stage = std::span<T>(change_).subspan(size_t(i) * m_, m_);
      manifold_->rows()->solve(of_stage);
      for (const size_t r : active) {
        const T I = Step::at(step_.L, n_ + r, i) + of_stage[r];
        const int last = i + 1 == step_.s ? W : i + 1;  // spare lanes repeat the last stage
        for (int lane = i; lane < last; ++lane) Step::set_stage(step_.L, n_ + r, lane, I);
      }
    }
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      for (const size_t r : active) lambda_[r] = step_.L[size_t(c)][n_ + r];
      rows_at_[size_t(c)]->forces(lambda_, F_[size_t(c)], used(c));
    }
  }
  /// L = h b f - F. @return whether it is finite
  bool take_slopes(SweepMoves& moves) {
    double total = 0;
    for (size_t k = 0; k < n_; ++k) {
      double move = 0;
      for (int c = 0; c < chunks && used(c) > 0; ++c) {
        Lanes& own = step_.L[size_t(c)][k];
        const Lanes to = step_.hb[size_t(c)] * f_[size_t(c)][k] - F_[size_t(c)][k];
        move = std::max(move, largest_of(magnitudes(to - own)));
        for (int i = 0; i < used(c); ++i) total += magnitude(to[i]);
        own = to;
      }
      sizes_.count(k, move, moves);
    }
    return std::isfinite(total);
  }

  // --- the end of the step -----------------------------------------------------------------------
  /// Leaves the state as it was unless the end is finite and on the manifold.
  Outcome finish(State& state, T h) {
    if (port_work_.any()) book();
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(state.x[k], state.lo[k], step_.sum(k));
    if (const Outcome o = bring_back(t_ + h, state); o != Outcome::ok) {
      std::copy_n(start_.begin(), n_, state.x.begin());
      std::copy_n(start_lo_.begin(), n_, state.lo.begin());
      return o;
    }
    std::swap(step_.L, step_.L_before);
    have_before_ = true;
    h_before_ = h;
    return Outcome::ok;
  }
  Outcome bring_back(T t, State& state) {
    if (m_ == 0) return Outcome::ok;
    if (!manifold_->bring_positions_back(t, state)) return Outcome::not_converged;
    manifold_->bring_momenta_back(t, state, impulse_);
    if (port_work_.any()) book_projection();
    double sum = 0;
    for (const T& slip : manifold_->slip()) sum += magnitude(slip);
    return std::isfinite(sum) ? Outcome::ok : Outcome::not_finite;
  }
  /// Σ h b_i power(Y_i); the reactions there, -I_i Bᵀe.
  void book() {
    port_work_.restart();
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      field_.powers(
          t_, step_.ch[size_t(c)], stages(c), f_[size_t(c)], E_, used(c),
          [&](size_t a, int i, T power) { port_work_.add(a, step_.hb[size_t(c)][i] * power); });
      if (m_ == 0) continue;
      rows_at_[size_t(c)]->drifts(row_, used(c));
      for (const auto& block : system_->description().constraints) {
        if (block.power < 0) continue;
        T work(0.0);
        for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r)
          for (int i = 0; i < used(c); ++i)
            work = work - step_.L[size_t(c)][n_ + r][i] * (slip_[size_t(c)][r][i] - row_[r][i]);
        port_work_.add(size_t(block.power), work);
      }
    }
  }

  /// What moving rows put in by the impulse at the end.
  void book_projection() {
    for (const auto& block : system_->description().constraints) {
      if (block.power < 0 || !block.moving) continue;
      T work(0.0);
      for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r)
        work = work + impulse_[r] * manifold_->drift()[r];
      port_work_.add(size_t(block.power), work);
    }
  }

  size_t m_;  ///< rows
  Step step_;
  T t_ = T(0.0);
  StageField<T, V> field_;
  StateSizes<T> sizes_;
  std::optional<Manifold<T>> manifold_;  ///< at the start, then at the end of the step
  std::array<std::unique_ptr<StageConstraints<T, V>>, size_t(chunks)> rows_at_;
  std::vector<T> start_, start_lo_;  ///< with m zeros
  Stages f_, F_, slip_;
  std::vector<Lanes> E_, row_, lambda_;
  std::vector<T> change_;   ///< of impulses, s × m
  std::vector<T> impulse_;  ///< of the projection
  std::array<typename Step::Weights, size_t(W)> response_;
  TurnKeeper<T> keeper_;
  SweepEnd end_;
  bool have_before_ = false;
  T h_before_ = T(0.0);
};

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_projected_gauss(const Declaration& d, int s,
                                                         const phs::Model& model, T h,
                                                         const Options& o) {
  auto table = gauss_table<TableReal<T>>(s);
  if (s <= 4) return std::make_unique<ProjectedGauss<T, 4>>(d, std::move(table), model, h, o);
  return std::make_unique<ProjectedGauss<T, 8>>(d, std::move(table), model, h, o);
}

}  // namespace

Entries projected_gauss_entries() {
  Entries e;
  for (int s = 8; s >= 1; --s)
    e.push_back(entry(
        {.name = "pgauss" + std::to_string(2 * s),
         .title = "projected Gauss collocation, " + std::to_string(s) +
                  (s == 1 ? " stage" : " stages") + ", for rolling bodies and other constraints",
         .family = "Projected Gauss, for rolling bodies",
         .order = 2 * s,
         .symmetric = Claim::unknown,
         .symplectic = Claim::unknown,
         .quadratic_invariants = Claim::unknown,
         .constraints = true,
         .rolling = true,
         .source = "Ascher, Petzold 1991, SIAM J. Numer. Anal. 28:1097"},
        [s](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
          return make_projected_gauss(d, s, m, h, o);
        }));
  return e;
}

}  // namespace porthos::integrators
