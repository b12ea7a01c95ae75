#include "integrators/derivatives/step_variation.h"

#include <Eigen/LU>
#include <algorithm>

#include "integrators/derivatives/discrete_gradient_variation.h"
#include "integrators/derivatives/dual_step_variation.h"
#include "integrators/derivatives/run_instants.h"
#include "integrators/derivatives/semi_implicit_euler_variation.h"
#include "integrators/derivatives/stormer_verlet_variation.h"
#include "integrators/methods/collocation_stages.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

[[noreturn]] void refuse_inside() {
  throw InvalidArgument("a tangent inside a step is there for Gauss collocation alone");
}

/// That of the adjoint, with its stages in reverse order: μ_ij is μ_ji of the step.
CollocationTable<double> transposed(CollocationTable<double> t) {
  const size_t s = size_t(t.s), r = size_t(t.degree());
  std::ranges::reverse(t.b);
  std::ranges::reverse(t.c);
  for (double& c : t.c) c = 1 - c;
  const std::vector<double> legendre = t.legendre;  // P_k(-x) = (-1)^k P_k(x)
  for (size_t i = 0; i < s; ++i)
    for (size_t k = 0; k < r; ++k)
      t.legendre[i * r + k] = (k % 2 ? -1 : 1) * legendre[(s - 1 - i) * r + k];
  for (auto* mu : {&t.mu, &t.mu_p}) {
    const std::vector<double> of_step = *mu;
    for (size_t i = 0; i < s && !mu->empty(); ++i)
      for (size_t j = 0; j < s; ++j) (*mu)[(s - 1 - i) * s + (s - 1 - j)] = of_step[j * s + i];
  }
  return t;
}

template <int W>
class CollocationVariation final : public StepVariation {
  using Step = CollocationStages<double, W>;
  using Lanes = typename Step::Lanes;
  static constexpr int V = Step::V, chunks = W / V;
  static constexpr size_t most_unknowns = 2000;  ///< of a direct solution
  static constexpr int direct_for = 32;

 public:
  CollocationVariation(const phs::Model& model, const CollocationTable<double>& table, Side side)
      : n_(size_t(model.description().nx)),
        reversed_(side == Side::adjoint),
        nodes_(table.c),
        step_(reversed_ ? transposed(table) : table, n_),
        solver_(Stagnation::of<double>(), Options{.solver = Solver::fixed_point}, n_),
        turns_(model.description()) {
    for (int c = 0; c < chunks; ++c) {
      field_[c].assign(n_, Lanes(0.0));
      linear_[c] = linearise_run<Lanes>(model);
      running_[c].assign(n_, Lanes(0.0));
      used_[c] = Lanes(0.0);
      for (int l = 0; l < V && c * V + l < table.s; ++l) used_[c].set(l, 1.0);
    }
    gradient_.resize(parameters().size());
  }

  void at(const StepPiece& step, const std::vector<std::int64_t>& turns) override {
    step_.adapt_to(step.h, have_before_ ? h_ : step.h);
    h_ = step.h;
    turns_.when_changed(turns, [&](std::span<const Lanes> angles) {
      for (auto& linear : linear_) linear->set_turn_angles(angles);
    });
    for (int c = 0; c < chunks; ++c) {
      Lanes time(step.t);
      for (int l = 0; l < V; ++l) time.set(l, step.t + h_ * nodes_[size_t(stage(c * V + l))]);
      gather(step.Y, c, step_.Y[c]);
      linear_[c]->at(time, step_.Y[c], field_[c]);
    }
  }

  Outcome advance(TwoWords& v, std::span<const double> running) override {
    runs_ = !running.empty();
    for (int c = 0; runs_ && c < chunks; ++c) gather(running, c, running_[c]);
    Equations equations{*this, v};
    ++cost_.steps;
    Outcome o = Outcome::not_converged;
    if (direct_steps_ == 0) o = solver_.solve(equations, have_before_, cost_);
    if (o == Outcome::not_converged && n_ * size_t(step_.s) <= most_unknowns) {
      direct_steps_ = direct_steps_ > 0 ? direct_steps_ - 1 : direct_for;
      o = directly(v);
    }
    have_before_ = o == Outcome::ok;
    if (o != Outcome::ok) return o;
    for (size_t k = 0; k < n_; ++k) v.add(k, step_.sum(k));
    std::swap(step_.L, step_.L_before);
    return o;
  }

  void interpolate(const TwoWords& after, double theta, std::span<double> v) const override {
    double B[W];
    step_.table.polynomial(theta, std::span(B).first(size_t(step_.s)));
    for (size_t k = 0; k < n_; ++k) {
      v[k] = after.lo[k];
      for (int j = 0; j < step_.s; ++j) v[k] += (B[j] - 1) * Step::at(step_.L_before, k, j);
      v[k] += after.x[k];
    }
  }

  void stages(std::span<double> to) const override {
    for (int j = 0; j < step_.s; ++j)
      for (size_t k = 0; k < n_; ++k) to[size_t(stage(j)) * n_ + k] = Step::at(step_.Y, k, j);
  }
  void forget() override { have_before_ = false; }

  void add_gradient(TwoWords& gradient) override {
    std::fill(gradient_.begin(), gradient_.end(), Lanes(0.0));
    for (int c = 0; c < chunks; ++c) linear_[c]->add_gradient(used_[c] * step_.hb[c], gradient_);
    for (size_t a = 0; a < gradient_.size(); ++a) {
      double sum = 0;
      for (int l = 0; l < V; ++l) sum += gradient_[a][l];
      gradient.add(a, sum);
    }
  }
  double by_size() const override {
    double sum = 0;
    for (int c = 0; c < chunks; ++c) {
      Lanes product(0.0);
      for (size_t k = 0; k < n_; ++k) product += step_.Y[c][k] * field_[c][k];
      product = used_[c] * step_.hb[c] * product;
      for (int l = 0; l < V; ++l) sum += product[l];
    }
    return sum;
  }
  const std::vector<std::string>& parameters() const override { return linear_[0]->parameters(); }
  const Cost& cost() const override { return cost_; }

 private:
  /// The equations that the solver works on.
  struct Equations {
    CollocationVariation& own;
    const TwoWords& v;
    void guess(bool predicted) { own.step_.guess(v.x, v.lo, 1, predicted ? 1 : 0); }
    Sweep sweep(double& distance) {
      own.improve();
      const auto moves = own.step_.sweep(v.x, Step::low_words(v.lo), 1);
      distance = moves.distance;
      return moves.in_lane(0);
    }
    void finish() { own.improve(); }
    void freeze(SimplifiedNewton&, Solver) {}  // by fixed point alone
    double newton_step() const { return own.h_; }
  };

  void improve() {
    ++cost_.sweeps;
    for (int c = 0; c < chunks; ++c) slopes(c, runs_, step_.L[c]);
  }
  /// h b (Df Y + running)
  void slopes(int c, bool runs, std::vector<Lanes>& to) {
    if (reversed_)
      linear_[c]->transpose_times(step_.Y[c], to);
    else
      linear_[c]->times(step_.Y[c], to);
    for (size_t k = 0; k < n_; ++k) to[k] = step_.hb[c] * (runs ? to[k] + running_[c][k] : to[k]);
  }

  /// The linear equations of a stiff step by LU: (1 - h b Df μ) L = h b (Df v + running), with the
  /// solution refined twice.
  Outcome directly(const TwoWords& v) {
    using Index = Eigen::Index;
    const Index n = Index(n_), s = step_.s;
    typename Step::Stages F = step_.L;
    Eigen::MatrixXd A = Eigen::MatrixXd::Identity(n * s, n * s);
    for (Index k = 0; k < n; ++k) {
      for (int c = 0; c < chunks; ++c) {
        for (Index i = 0; i < n; ++i) step_.Y[c][size_t(i)] = Lanes(i == k ? 1.0 : 0.0);
        slopes(c, false, F[c]);
      }
      const auto& t = step_.table;
      const auto& mu = k < n / 2 || t.mu_p.empty() ? t.mu : t.mu_p;
      for (Index i = 0; i < s; ++i)
        for (Index j = 0; j < s; ++j)
          for (Index a = 0; a < n; ++a)
            A(i * n + a, j * n + k) -= Step::at(F, size_t(a), int(i)) * mu[size_t(i * s + j)];
    }
    ++cost_.factorisations;
    const Eigen::PartialPivLU<Eigen::MatrixXd> lu(A);
    Eigen::VectorXd r(n * s);
    for (int c = 0; c < chunks; ++c) std::fill(step_.L[c].begin(), step_.L[c].end(), Lanes(0.0));
    for (int pass = 0; pass < 4; ++pass) {
      step_.renew(v.x, Step::low_words(v.lo));
      for (int c = 0; c < chunks; ++c) slopes(c, runs_, F[c]);  // the last time for add_gradient()
      if (pass == 3) break;
      for (Index i = 0; i < s; ++i)
        for (size_t a = 0; a < n_; ++a)
          r[i * n + Index(a)] = Step::at(F, a, int(i)) - Step::at(step_.L, a, int(i));
      r = lu.solve(r);
      if (!r.allFinite()) return Outcome::not_finite;
      for (size_t a = 0; a < n_; ++a)
        for (int i = 0; i < W; ++i)
          Step::set_stage(step_.L, a, i,
                          Step::at(step_.L, a, i) + r[Index(step_.row(i)) * n + Index(a)]);
    }
    return Outcome::ok;
  }
  /// The stage in a lane.
  int stage(int i) const { return reversed_ ? step_.s - 1 - step_.row(i) : step_.row(i); }
  void gather(std::span<const double> values, int c, std::vector<Lanes>& lanes) const {
    for (int l = 0; l < V; ++l) {
      const double* from = values.data() + size_t(stage(c * V + l)) * n_;
      for (size_t k = 0; k < n_; ++k) lanes[k].set(l, from[k]);
    }
  }

  size_t n_;
  double h_ = 0;  ///< of the step, the last one's until the next at()
  bool reversed_;
  std::vector<double> nodes_;  ///< of the step, not reversed
  Step step_;
  StepSolver solver_;
  TurnKeeper<Lanes> turns_;
  std::unique_ptr<phs::Linearised<Lanes>> linear_[chunks];
  std::vector<Lanes> running_[chunks], field_[chunks];
  Lanes used_[chunks];  ///< 1 in lanes with a stage
  std::vector<Lanes> gradient_;
  bool have_before_ = false, runs_ = false;
  int direct_steps_ = 0;  ///< left before the iteration is tried again
  Cost cost_;
};

}  // namespace

void StepVariation::interpolate(const TwoWords&, double, std::span<double>) const {
  refuse_inside();
}
void StepVariation::stages(std::span<double>) const { refuse_inside(); }

std::unique_ptr<StepVariation> make_step_variation(const phs::Model& model,
                                                   const CollocationTable<double>& table,
                                                   StepVariation::Side side) {
  if (table.s <= 4) return std::make_unique<CollocationVariation<4>>(model, table, side);
  if (table.s <= 8) return std::make_unique<CollocationVariation<8>>(model, table, side);
  return std::make_unique<CollocationVariation<16>>(model, table, side);
}

std::unique_ptr<StepVariation> make_step_variation(const phs::Model& model,
                                                   const StepPieces& pieces,
                                                   StepVariation::Side side) {
  if (const auto* steps = dynamic_cast<const DiscreteGradientSteps*>(&pieces.staged()))
    return make_discrete_gradient_variation(model, steps->rule(), side);
  if (dynamic_cast<const SemiImplicitEulerSteps*>(&pieces.staged()))
    return make_semi_implicit_euler_variation(model, side);
  if (pieces.by_table()) return make_step_variation(model, pieces.table(), side);
  return pieces.multipliers() > 0
             ? make_stormer_verlet_variation(model, side)
             : make_dual_step_variation(model, pieces.method().declaration().name, side);
}

std::vector<std::string> parameters_of_run(const std::string& method, const phs::Model& model,
                                           double h) {
  const OfRun run(model);
  const StepPieces pieces(method, *run.model, h);
  const auto adjoint = make_step_variation(*run.model, pieces, StepVariation::Side::adjoint);
  const RunInstants instants(*run.model);
  instants.require(adjoint->parameters(), method);
  return instants.names(adjoint->parameters());
}

}  // namespace porthos::integrators
