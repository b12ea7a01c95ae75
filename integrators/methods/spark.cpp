#include "integrators/methods/spark.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "integrators/core/stage_constraints.h"
#include "integrators/core/stage_field.h"
#include "integrators/core/turns.h"
#include "integrators/methods/collocation_stages.h"
#include "integrators/methods/manifold.h"
#include "integrators/methods/spark_nodes.h"

namespace porthos::integrators {
namespace {

template <class T, int W>
class Spark final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::options_, Base::system_, Base::port_work_;
  using typename Base::State;
  using Step = CollocationStages<T, W>;
  using Nodes = SparkNodes<T, W>;
  using Real = typename Step::Real;
  using Lanes = typename Step::Lanes;
  static constexpr int V = Step::V, chunks = W / V;

 public:
  Spark(Declaration d, SparkTable<Real> t, const phs::Model& model, T h, const Options& o)
      : Base(std::move(d), model, h, o),
        m_(size_t(model.description().constraint_count())),
        step_(t.gauss, n_),
        nodes_(std::move(t), model.description(), m_),
        field_(model, *system_, o.lanes),
        E_(port_work_.any() ? n_ : 0),
        slip_(m_, T(0.0)),
        start_slip_(slip_),
        drift_(slip_),
        start_drift_(slip_),
        lambda_(m_, Lanes(T(0.0))),
        moves_(std::any_of(model.description().constraints.begin(),
                           model.description().constraints.end(),
                           [](const phs::ConstraintBlock& b) { return b.moving; })),
        keeper_(model.description()),
        iteration_(Stagnation::of<T>(o.iteration_tolerance)) {
    for (auto& f : f_) f.resize(port_work_.any() ? n_ : 0);
    if (m_ == 0) return;
    step_.count_positions(model.description());
    manifold_.emplace(*system_, m_, cost_);
    start_ = &manifold_->rows();
    for (auto& rows : rows_at_) rows = std::make_unique<StageConstraints<T, V>>(model, o.lanes);
  }

  void tell_turns(const State& state) override {
    Base::tell_turns(state);
    field_.tell_turns(state.turns);
    if (m_ == 0) return;
    keeper_.when_changed(state.turns, [&](std::span<const T> angles) {
      start_->set_turn_angles(angles);
      for (auto& rows : rows_at_) rows->set_turn_angles(angles);
    });
  }

  Outcome advance(T t, T h, State& state) override {
    t_ = t;
    const T before = have_before_ ? h_before_ : h;
    step_.adapt_to(table_real(h), table_real(before));
    nodes_.adapt_to(table_real(h), table_real(before));
    if (moves_) begin_drift(t);
    const bool same_rows = m_ == 0 || start_->choose(state.x);
    if (!same_rows) std::fill(lambda_.begin(), lambda_.end(), Lanes(T(0.0)));
    if (m_ > 0 && !start_->trouble().empty()) return give_up(Outcome::singular);
    const bool predicted = memory_.trusts(have_before_);
    Outcome o = iterate(state, predicted, same_rows);
    if (o != Outcome::ok && predicted) o = iterate(state, false, same_rows);
    if (o != Outcome::ok) return give_up(o);
    finish(state, h);
    return Outcome::ok;
  }

  bool interpolate(const State& after, T theta, std::span<T> x) const override {
    if (!have_before_ || m_ > 0) return false;
    interpolate_step<W>(
        step_.table, after, theta, [&](size_t k, int j) { return Step::at(step_.L_before, k, j); },
        x.first(n_));
    return true;
  }

  void carry(Archive& a) override {
    a(have_before_);
    a(h_before_);
    a(memory_.distrust);
    step_.carry(a, 0);
    nodes_.carry(a);
    a(slip_);
    if (m_ > 0) start_->carry(a);
  }
  std::string remark() const override { return m_ > 0 ? start_->trouble() : ""; }
  bool integrates_power() const override { return true; }

 private:
  int used(int c) const { return std::clamp(step_.s - c * V, 0, V); }
  /// The time of moving rows, and ∂g/∂t at the start and at the nodes.
  void begin_drift(T t) {
    (*start_)->set_time(t);
    std::fill(drift_.begin(), drift_.end(), T(0.0));
    (*start_)->add_drift(drift_);
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      rows_at_[size_t(c)]->set_times(Lanes(t) + nodes_.node_time[size_t(c)], used(c));
      rows_at_[size_t(c)]->drifts(nodes_.drift[size_t(c)], used(c));
    }
  }
  Outcome give_up(Outcome o) {
    have_before_ = false;
    return m_ > 0 ? start_->give_up(o) : o;
  }

  // --- the iteration ----------------------------------------------------------------------------
  Outcome iterate(const State& state, bool predicted, bool same_rows) {
    bool first_sweep = true, at_rest = false;  // at rest: the stages, as far as the guess knows
    double last = 0;                           // move
    const auto guess = [&](bool with) {
      first_sweep = true;
      at_rest = !with;
      hold_ = false;
      step_.guess_slopes(with);
      step_.measure_anew(state.x, 1);
      nodes_.guess(with && same_rows);
      if (m_ > 0) {
        place_nodes(state);
        push(state);
      }
      with_first(state, [&](const auto& first) { step_.renew(state.x, first); });
    };
    const auto sweep = [&](double& distance) {
      evaluate();
      const bool held = hold_;
      if (m_ > 0 && !held) {
        place_nodes(state);
        correct_impulses();
        push(state);
      }
      typename Step::Moves moves;
      with_first(state, [&](const auto& first) { moves = step_.sweep(state.x, first, 1); });
      distance = moves.distance;
      Sweep s = moves.in_lane(0);
      if (m_ == 0) return s;
      // Positions, which alone count, answer to forces one sweep later: one small move, as where a
      // force just begins, is no end. A sudden ratio of following moves is not trusted.
      s.changed = s.changed || !held;
      hold_ = held || (!first_sweep && only_noise(s.change, last));
      const double move = s.change, sudden = 1e-5;
      if (first_sweep)
        s.change =
            std::max(move, at_rest || distance == 0 ? 1.0 : std::max(sudden * distance, 1e-9));
      else
        s.change = std::max(move, sudden * last);
      last = first_sweep && at_rest ? 1.0 : move;
      first_sweep = false;
      return s;
    };
    const Iteration parts{guess, sweep, [] {}, [] { return 0.0; }, [&] { evaluate(); }};
    const Outcome o =
        integrators::iterate(parts, iteration_, predicted, options_.max_sweeps).outcome;
    if (iteration_.dropped()) memory_.dropped_prediction();
    return o;
  }
  /// Whether two moves in turn show noise alone. Further corrections of impulses would only stir
  /// positions up again; without them the iteration comes to an end.
  static bool only_noise(double move, double last) {
    return std::max(move, last) < 64 * unit_roundoff<T> && move > 0.5 * last && move < 2 * last;
  }
  /// Calls use(first), where first(c, k) is what stages add up beside L.
  template <class Use>
  void with_first(const State& state, const Use& use) const {
    if (m_ > 0)
      use([&](int c, size_t k) { return nodes_.first(c, k); });
    else
      use(Step::low_words(state.lo));
  }
  /// L = h b f(Y)
  void evaluate() {
    cost_.evaluations += step_.s;
    ++cost_.sweeps;
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      field_.field(t_, step_.ch[size_t(c)], step_.Y[size_t(c)], step_.L[size_t(c)], used(c));
      for (Lanes& slope : step_.L[size_t(c)]) slope = step_.hb[size_t(c)] * slope;
    }
  }
  void place_nodes(const State& state) {
    nodes_.place(state.x, state.lo, step_.L);
    for (int c = 0; c < chunks && used(c) > 0; ++c)
      rows_at_[size_t(c)]->place(nodes_.Q[size_t(c)], nodes_.g[size_t(c)], used(c));
  }
  void correct_impulses() {
    nodes_.correct(start_->active(), [&](std::span<T> r) { (*start_)->solve_all(r, V); });
  }
  /// The forces of all impulses but the last.
  void push(const State& state) {
    const auto& active = start_->active();
    std::fill(start_impulse_.begin(), start_impulse_.end(), T(0.0));
    for (const size_t r : active) start_impulse_[r] = nodes_.impulse(0, r);
    (*start_)->forces(start_impulse_, nodes_.F_start);
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      for (const size_t r : active) nodes_.impulses_of(c, r, lambda_[r]);
      rows_at_[size_t(c)]->forces(lambda_, nodes_.F[size_t(c)], used(c));
    }
    nodes_.push(state.lo);
  }

  // --- the end of the step -----------------------------------------------------------------------
  void finish(State& state, T h) {
    for (size_t k = 0; k < n_; ++k) phs::compensated_add(state.x[k], state.lo[k], step_.sum(k));
    if (m_ > 0) {
      for (const size_t k : nodes_.momenta())
        phs::compensated_add(state.x[k], state.lo[k], -nodes_.pushed_by(k));
      last_impulse(state, h);
    }
    if (port_work_.any()) book();
    std::swap(step_.L, step_.L_before);
    nodes_.keep();
    have_before_ = true;
    h_before_ = h;
  }
  /// I_s from B(y')ᵀ e(y') + ∂g/∂t = 0, linear in I_s.
  void last_impulse(State& state, T h) {
    std::swap(start_slip_, slip_);
    std::swap(start_drift_, drift_);
    manifold_->bring_momenta_back(t_ + h, state, nodes_.last());
    std::copy(manifold_->slip().begin(), manifold_->slip().end(), slip_.begin());
    std::copy(manifold_->drift().begin(), manifold_->drift().end(), drift_.begin());
  }

  /// Σ h b_i power(Y_i), where f(Y_i) = L_i / (h b_i); the reactions at the ends of the step; what
  /// moving rows put in, I_j ∂g/∂t, at all nodes.
  void book() {
    port_work_.restart();
    for (int c = 0; c < chunks && used(c) > 0; ++c) {
      auto& f = f_[size_t(c)];
      for (size_t k = 0; k < n_; ++k) f[k] = step_.L[size_t(c)][k] / step_.hb[size_t(c)];
      field_.powers(
          t_, step_.ch[size_t(c)], step_.Y[size_t(c)], f, E_, used(c),
          [&](size_t a, int i, T power) { port_work_.add(a, step_.hb[size_t(c)][i] * power); });
    }
    for (const auto& block : system_->description().constraints) {
      if (block.power < 0) continue;
      T work(0.0);
      for (size_t r = size_t(block.at); r < size_t(block.at + block.size); ++r) {
        const T first = nodes_.impulse(0, r), last = nodes_.last()[r];
        work = work - first * start_slip_[r] - last * slip_[r];
        if (block.moving) work = work + (first * start_drift_[r] + last * drift_[r]);
        for (int j = 1; block.moving && j < step_.s; ++j)
          work = work + nodes_.impulse(size_t(j), r) * Step::at(nodes_.drift, r, j - 1);
      }
      port_work_.add(size_t(block.power), work);
    }
  }

  size_t m_;  ///< rows
  Step step_;
  Nodes nodes_;
  T t_ = T(0.0);
  StageField<T, V> field_;
  std::optional<Manifold<T>> manifold_;
  StepRows<T>* start_ = nullptr;  ///< at the start, then at the end of the step; null: no rows
  std::array<std::unique_ptr<StageConstraints<T, V>>, size_t(chunks)> rows_at_;
  typename Step::Stages f_;
  std::vector<Lanes> E_;
  std::vector<T> slip_, start_slip_, drift_, start_drift_, start_impulse_{slip_};
  std::vector<Lanes> lambda_;
  bool hold_ = false;  ///< impulses are no more corrected in this step
  bool moves_;         ///< some rows do
  TurnKeeper<T> keeper_;
  Iterating iteration_;
  SolverMemory memory_;
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
