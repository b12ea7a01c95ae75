#include "integrators/methods/spark.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "integrators/core/stage_constraints.h"
#include "integrators/core/stage_field.h"
#include "integrators/core/turns.h"
#include "integrators/methods/manifold.h"
#include "integrators/methods/spark_stages.h"

namespace porthos::integrators {
namespace {

template <class T, int W>
class Spark final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::options_, Base::system_, Base::port_work_;
  using typename Base::State;
  using Step = SparkStages<T, W>;
  using Real = typename Step::Real;
  using Lanes = typename Step::Lanes;
  static constexpr int V = Step::V, chunks = Step::chunks;
  using Nodes = std::array<std::unique_ptr<StageConstraints<T, V>>, size_t(chunks)>;

 public:
  Spark(Declaration d, SparkTable<Real> t, const phs::Model& model, T h, const Options& o)
      : Base(std::move(d), model, h, o),
        m_(size_t(model.description().constraint_count())),
        step_(std::move(t), model.description(), m_),
        field_(model, *system_, o.lanes),
        E_(port_work_.any() ? n_ : 0),
        start_slip_(m_, T(0.0)),
        slip_(m_, T(0.0)),
        start_drift_(slip_),
        drift_(slip_),
        change_(m_ * size_t(step_.s), T(0.0)),
        lambda_(m_, Lanes(T(0.0))),
        moves_(std::any_of(model.description().constraints.begin(),
                           model.description().constraints.end(),
                           [](const phs::ConstraintBlock& b) { return b.moving; })),
        keeper_(model.description()),
        end_(unit_roundoff<T>, o.iteration_tolerance) {
    for (auto& f : field_at_) f.resize(n_);
    if (m_ == 0) return;
    manifold_.emplace(*system_, m_, cost_);
    start_ = &manifold_->rows();
    for (auto& nodes : nodes_) nodes = std::make_unique<StageConstraints<T, V>>(model, o.lanes);
    step_.adapt_to(table_real(h), table_real(h));
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    field_.tell_turns(state.turns);
    if (m_ == 0) return;
    keeper_.when_changed(state.turns, [&](std::span<const T> angles) {
      start_->set_turn_angles(angles);
      for (auto& nodes : nodes_) nodes->set_turn_angles(angles);
    });
  }

  Outcome advance(T t, T h, State& state) override {
    t_ = t;
    step_.adapt_to(table_real(h), table_real(have_before_ ? h_before_ : h));
    if (moves_) begin_drift(t);
    const bool same_rows = m_ == 0 || start_->choose(state.x);
    if (!same_rows) std::fill(lambda_.begin(), lambda_.end(), Lanes(T(0.0)));
    if (m_ > 0 && !start_->trouble().empty()) return give_up(Outcome::singular);
    Outcome o = Outcome::not_converged;
    if (have_before_) o = iterate(state, true, same_rows);
    if (o != Outcome::ok) o = iterate(state, false, false);
    if (o != Outcome::ok) return give_up(o);
    finish(state, h);
    return Outcome::ok;
  }

  bool interpolate(const State& after, T theta, std::span<T> x) const override {
    if (!have_before_ || m_ > 0) return false;
    interpolate_step<W>(
        step_.table.gauss, after, theta,
        [&](size_t k, int j) { return Step::at(step_.L_before, k, j); }, x.first(n_));
    return true;
  }

  void carry(Archive& a) override {
    a(have_before_);
    a(h_before_);
    step_.carry(a);
    a(slip_);
    if (m_ > 0) start_->carry(a);
  }
  std::string remark() const override { return m_ > 0 ? start_->trouble() : ""; }
  bool integrates_power() const override { return true; }

 private:
  /// The time of moving rows, and ∂g/∂t at the start and at the nodes.
  void begin_drift(T t) {
    (*start_)->set_time(t);
    std::fill(drift_.begin(), drift_.end(), T(0.0));
    (*start_)->add_drift(drift_);
    for (int c = 0; c < chunks; ++c)
      if (const int used = Step::used(step_.s, c); used > 0) {
        nodes_[size_t(c)]->set_times(Lanes(t) + step_.node_time[size_t(c)], used);
        nodes_[size_t(c)]->drifts(step_.drift[size_t(c)], used);
      }
  }
  Outcome give_up(Outcome o) {
    have_before_ = false;
    if (m_ == 0) return o;
    start_->forget();
    return o == Outcome::not_converged && start_->near_singular() ? Outcome::singular : o;
  }

  // --- the iteration ----------------------------------------------------------------------------
  Outcome iterate(const State& state, bool predicted, bool impulses) {
    step_.guess(predicted, impulses);
    if (m_ > 0) {
      place_nodes(state);
      push();
    }
    step_.place_stages(state.x, state.lo);
    SweepMoves moves;
    if (!evaluate(moves)) return Outcome::not_finite;
    end_.restart();
    for (int sweep = 0; sweep < options_.max_sweeps; ++sweep) {
      if (m_ > 0) {
        place_nodes(state);
        correct_impulses();
        push();
      }
      step_.place_stages(state.x, state.lo);
      moves = {};
      if (!evaluate(moves)) return Outcome::not_finite;
      switch (end_.after(moves)) {
        case SweepEnd::Verdict::ended:
          return Outcome::ok;
        case SweepEnd::Verdict::diverges:
          return Outcome::not_converged;
        case SweepEnd::Verdict::go_on:
          break;
      }
    }
    return end_.near_rounding() ? Outcome::ok : Outcome::not_converged;
  }
  /// L = h b f(Y). @return whether it is finite
  bool evaluate(SweepMoves& moves) {
    cost_.evaluations += step_.s;
    ++cost_.sweeps;
    for (int c = 0; c < chunks; ++c) {
      const int used = Step::used(step_.s, c);
      if (used == 0) break;
      auto& f = field_at_[size_t(c)];
      field_.field(t_, step_.ch[size_t(c)], step_.Y[size_t(c)], f, used);
      if (!step_.take_slopes(c, f, moves)) return false;
    }
    return true;
  }
  void place_nodes(const State& state) {
    step_.place_nodes(state.x, state.lo);
    for (int c = 0; c < chunks; ++c)
      if (const int used = Step::used(step_.s, c); used > 0)
        nodes_[size_t(c)]->place(step_.Q[size_t(c)], step_.g[size_t(c)], used);
  }
  /// I += (B⁻¹ ⊗ D⁻¹) g / h, in the rows in use.
  void correct_impulses() {
    const T over_h = T(1.0) / h_of_step();
    for (const size_t r : start_->active()) step_.respond(r, over_h, change_);
    for (int k = 0; k < step_.s; ++k) {
      const auto of_node = std::span<T>(change_).subspan(size_t(k) * m_, m_);
      (*start_)->solve(of_node);
      for (const size_t r : start_->active()) {
        T& I = step_.impulse[size_t(k) * m_ + r];
        I = I + of_node[r];
      }
    }
  }
  T h_of_step() const {
    T h(0.0);
    for (int i = 0; i < step_.s; ++i) h = h + step_.hb[size_t(i / V)][i % V];
    return h;
  }
  /// The forces of all impulses but the last.
  void push() {
    const auto first = std::span<T>(step_.impulse).first(m_);
    (*start_)->forces(first, step_.F_start);
    for (int c = 0; c < chunks; ++c) {
      const int used = Step::used(step_.s, c);
      if (used == 0) break;
      for (const size_t r : start_->active())
        for (int i = 0; i < V; ++i) {
          const int node = c * V + i + 1;
          lambda_[r].set(i, node < step_.s ? step_.impulse[size_t(node) * m_ + r] : T(0.0));
        }
      nodes_[size_t(c)]->forces(lambda_, step_.F[size_t(c)], used);
    }
  }

  // --- the end of the step -----------------------------------------------------------------------
  void finish(State& state, T h) {
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(state.x[k], state.lo[k], step_.sum(k));
    if (m_ > 0) {
      for (const size_t k : step_.pushed())
        phs::compensated_add(state.x[k], state.lo[k], -step_.pushed_by(k));
      last_impulse(state, h);
    }
    if (port_work_.any()) book();
    step_.keep();
    have_before_ = true;
    h_before_ = h;
  }
  /// I_s from B(y')ᵀ e(y') + ∂g/∂t = 0, linear in I_s.
  void last_impulse(State& state, T h) {
    std::swap(start_slip_, slip_);
    std::swap(start_drift_, drift_);
    const auto I_s = std::span<T>(step_.impulse).subspan(size_t(step_.s) * m_, m_);
    manifold_->bring_momenta_back(t_ + h, state, I_s);
    std::copy(manifold_->slip().begin(), manifold_->slip().end(), slip_.begin());
    std::copy(manifold_->drift().begin(), manifold_->drift().end(), drift_.begin());
  }

  /// Σ h b_i power(Y_i), where f(Y_i) = L_i / (h b_i); the reactions at the ends of the step; what
  /// moving rows put in, I_j ∂g/∂t, at all nodes.
  void book() {
    port_work_.restart();
    for (int c = 0; c < chunks; ++c) {
      const int used = Step::used(step_.s, c);
      if (used == 0) break;
      auto& f = field_at_[size_t(c)];
      for (size_t k = 0; k < n_; ++k) f[k] = step_.L[size_t(c)][k] / step_.hb[size_t(c)];
      field_.powers(
          t_, step_.ch[size_t(c)], step_.Y[size_t(c)], f, E_, used,
          [&](size_t a, int i, T power) { port_work_.add(a, step_.hb[size_t(c)][i] * power); });
    }
    for (const auto& block : system_->description().constraints) {
      if (block.power < 0) continue;
      T work(0.0);
      for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r) {
        const T &first = step_.impulse[r], &last = step_.impulse[size_t(step_.s) * m_ + r];
        work = work - first * start_slip_[r] - last * slip_[r];
        if (block.moving) work = work + (first * start_drift_[r] + last * drift_[r]);
        for (int j = 1; block.moving && j < step_.s; ++j)
          work = work + step_.impulse[size_t(j) * m_ + r] * Step::at(step_.drift, r, j - 1);
      }
      port_work_.add(size_t(block.power), work);
    }
  }

  size_t m_;  ///< rows
  Step step_;
  T t_ = T(0.0);
  StageField<T, V> field_;
  std::optional<Manifold<T>> manifold_;
  StepRows<T>* start_ = nullptr;  ///< at the start, then at the end of the step; null: no rows
  Nodes nodes_;
  typename Step::Stages field_at_;
  std::vector<Lanes> E_;
  std::vector<T> start_slip_, slip_, start_drift_, drift_;
  std::vector<T> change_;  ///< of impulses, s × m
  std::vector<Lanes> lambda_;
  bool moves_;  ///< some rows do
  TurnKeeper<T> keeper_;
  SweepEnd end_;
  bool have_before_ = false;
  T h_before_ = T(0.0);
};

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_spark(const Declaration& d, int s, const phs::Model& model,
                                               T h, const Options& o) {
  auto table = spark_table<TableReal<T>>(s);
  if (s <= 4) return std::make_unique<Spark<T, 4>>(d, std::move(table), model, h, o);
  return std::make_unique<Spark<T, 8>>(d, std::move(table), model, h, o);
}

}  // namespace

Entries spark_entries() {
  Entries e;
  for (int s = 8; s >= 1; --s)
    e.push_back(entry({.name = "spark" + std::to_string(2 * s),
                       .title = "Gauss-Lobatto SPARK, " + std::to_string(s) +
                                (s == 1 ? " stage" : " stages") + ", for constraints",
                       .family = "SPARK, for constraints",
                       .order = 2 * s,
                       .symmetric = Claim::holds,
                       .symplectic = Claim::holds,
                       .quadratic_invariants = Claim::holds,
                       .constraints = true,
                       .source = "Jay 2007, J. Comput. Appl. Math. 204:56"},
                      [s](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
                        return make_spark(d, s, m, h, o);
                      }));
  return e;
}

}  // namespace porthos::integrators
