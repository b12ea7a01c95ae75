#include "integrators/derivatives/run_gradient.h"

#include <algorithm>
#include <cmath>

namespace porthos::integrators {
namespace {

/// Where a run can be taken up again with the same bits.
struct Checkpoint {
  phs::State state;
  std::vector<double> memory;
};

/// One cost on its way back through the run.
struct Descent {
  const Objective& objective;
  std::unique_ptr<StepVariation> adjoint;
  TwoWords lambda, parameters, cost;
  TwoWords by_size;  ///< Σ h ∂J/∂h of the steps
  double size_at_end = 0;

  Descent(const Objective& J, std::unique_ptr<StepVariation> a, size_t n)
      : objective(J),
        adjoint(std::move(a)),
        lambda(n),
        parameters(adjoint->parameters().size()),
        cost(1),
        by_size(1) {}
};

/// A run backwards, for any number of costs. Stages come from the steps themselves, taken again
/// where they were not kept.
class Backwards {
 public:
  Backwards(const std::string& method, const phs::Model& model, double h,
            std::span<const Objective> objectives, const GradientOptions& options)
      : options_(options),
        pieces_(method, model, h),
        method_(pieces_.method()),
        n_(size_t(model.description().nx)),
        autonomous_(model.description().traits.autonomous),
        weights_(size_t(pieces_.table().s)),
        x_(n_),
        gradient_(n_) {
    for (const Objective& J : objectives)
      descents_.emplace_back(J, make_step_variation(model, pieces_, StepVariation::Side::adjoint),
                             n_);
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::angle) angle_at_.push_back(size_t(b.at));
  }

  std::vector<RunGradient> of(const phs::State& start, std::int64_t steps) {
    Checkpoint here{start, method_.memory()};
    whole_until_ = start.step + steps;
    const double length = double(steps) * method_.step_size() + options_.last;
    if (options_.last != 0) ++steps;
    plan(steps, here);
    work_ = double(forward_steps(steps, levels_) + steps * std::int64_t(descents_.size()));
    if (steps == 0) begin(start);
    const bool ok = steps == 0 || reverse(here, steps, levels_);
    std::vector<RunGradient> all;
    for (const Descent& d : descents_) {
      RunGradient r;
      r.outcome = ok ? Outcome::ok : outcome_;
      r.remark = remark_;
      r.cost = d.cost.x[0];
      r.end = end_;
      r.start = d.lambda.x;
      r.names = d.adjoint->parameters();
      r.parameters = d.parameters.x;
      r.duration = autonomous_ && steps > 0 ? d.by_size.x[0] / length : NAN;
      const double size = size_of(d.lambda.x);
      r.growth = !d.objective.end ? NAN : size == 0 ? 0 : std::log10(size / d.size_at_end);
      r.steps_taken = method_.cost().steps;
      r.adjoint = d.adjoint->cost();
      all.push_back(std::move(r));
    }
    return all;
  }

 private:
  /// Half of the memory holds the steps of a segment, half checkpoints. More levels where a run has
  /// more segments than checkpoints.
  void plan(std::int64_t steps, const Checkpoint& c) {
    const size_t row = row_size(), words = 2 * n_ + c.state.turns.size() + c.memory.size(),
                 half = options_.memory / 2 / sizeof(double);
    segment_ = std::max<std::int64_t>(1, std::int64_t(half / row));
    const double checkpoints = double(half) / double(words + 16);
    for (levels_ = 0;; ++levels_) {
      fan_ = std::max<std::int64_t>(2, std::int64_t(checkpoints / std::max(1, levels_)));
      if (double(segment_) * std::pow(double(fan_), levels_) >= double(steps)) break;
    }
    if (levels_ == 0) segment_ = steps;
    kept_.reserve(size_t(segment_) * row);
  }
  /// Numbers kept of a step: its pieces and its end.
  size_t row_size() const { return pieces_.numbers().size() + n_; }

  /// Steps between two checkpoints of a level.
  std::int64_t part_of(int level) const {
    std::int64_t part = segment_;
    for (int i = 1; i < level; ++i) part *= fan_;
    return part;
  }
  /// Steps that reverse() takes forwards.
  std::int64_t forward_steps(std::int64_t steps, int level) const {
    if (steps <= segment_) return steps;
    const std::int64_t part = part_of(level), parts = (steps - 1) / part;
    return parts * (part + forward_steps(part, level - 1)) +
           forward_steps(steps - parts * part, level - 1);
  }
  /// Takes λ back over `steps` steps from a checkpoint.
  bool reverse(const Checkpoint& from, std::int64_t steps, int level) {
    if (steps <= segment_) return forwards(from, steps, true) && backwards();
    const std::int64_t part = part_of(level);
    std::vector<Checkpoint> checkpoints{from};
    method_.restore(from.memory);
    state_ = from.state;
    for (std::int64_t done = part; done < steps; done += part) {
      if (!steps_forwards(part, false)) return false;
      checkpoints.push_back({state_, method_.memory()});
    }
    std::int64_t left = steps - part * std::int64_t(checkpoints.size() - 1);
    for (; !checkpoints.empty(); left = part) {
      if (!reverse(checkpoints.back(), left, level - 1)) return false;
      checkpoints.pop_back();
    }
    return true;
  }

  bool forwards(const Checkpoint& from, std::int64_t steps, bool keep) {
    method_.restore(from.memory);
    state_ = from.state;
    kept_.clear();
    turns_.clear();
    return steps_forwards(steps, keep);
  }
  bool steps_forwards(std::int64_t steps, bool keep) {
    for (std::int64_t i = 0; i < steps; ++i) {
      if (!went_on()) return false;
      const double t = method_.time(state_);
      const Outcome o = pieces_.step(state_, state_.step == whole_until_ ? options_.last : 0);
      if (o != Outcome::ok)
        return give_up(o, "the step at t = " + number(t) + " s: " + to_string(o));
      if (keep) keep_step();
    }
    return true;
  }
  /// Before a step, or a step back of one cost: about the same work. false: stopped.
  bool went_on() {
    if (options_.stop && options_.stop->load(std::memory_order_relaxed))
      return give_up(Outcome::failed, "the run was stopped");
    if (++done_ % 64 == 0 && options_.progress)
      options_.progress(std::min(1.0, double(done_) / work_));
    return true;
  }
  void keep_step() {
    if (turns_.empty() || turns_.back().turns != state_.turns)
      turns_.push_back({kept_.size() / row_size(), state_.turns});
    kept_.insert(kept_.end(), pieces_.numbers().begin(), pieces_.numbers().end());
    kept_.insert(kept_.end(), state_.x.begin(), state_.x.end());
  }

  bool backwards() {
    if (!begun_) begin(state_);
    const size_t row = row_size();
    for (size_t i = kept_.size() / row; i-- > 0;) {
      while (turns_.back().from > i) turns_.pop_back();
      const std::span<const double> step(kept_.data() + i * row, row);
      for (Descent& d : descents_)
        if (!back(d, step, turns_.back().turns)) return false;
    }
    return true;
  }
  /// Takes a cost back over a step.
  bool back(Descent& d, std::span<const double> step, const std::vector<std::int64_t>& turns) {
    if (!went_on()) return false;
    size_t i = pieces_.count() - 1;
    if (d.objective.sampled) {
      const StepPiece last = pieces_.at(step, i);
      add_cost(d, d.objective.sampled, last.t + last.h, step.last(n_), turns, 1);
      for (size_t k = 0; k < n_; ++k) d.lambda.add(k, gradient_[k]);
    }
    for (++i; i-- > 0;)
      if (!back_over(d, pieces_.at(step, i), turns)) return false;
    return true;
  }
  bool back_over(Descent& d, const StepPiece& piece, const std::vector<std::int64_t>& turns) {
    const auto& table = pieces_.table();
    const size_t s = weights_.size();
    running_.resize(d.objective.running ? s * n_ : 0);
    if (d.objective.running) table.weights(piece.h, weights_);
    for (size_t j = 0; j < s && d.objective.running; ++j) {
      const double part = add_cost(d, d.objective.running, piece.t + piece.h * table.c[j],
                                   piece.Y.subspan(j * n_, n_), turns, weights_[j]);
      d.by_size.add(0, part);
      std::copy(gradient_.begin(), gradient_.end(), running_.begin() + std::ptrdiff_t(j * n_));
    }
    d.adjoint->at(piece, turns);
    const Outcome o = d.adjoint->advance(d.lambda, running_);
    if (o != Outcome::ok)
      return give_up(o, "the adjoint of the step at t = " + number(piece.t) + " s: " +
                            (o == Outcome::not_converged
                                 ? "its iteration does not contract, expected a shorter step"
                                 : "it outgrew every number, expected a shorter run"));
    d.adjoint->add_gradient(d.parameters);
    d.by_size.add(0, d.adjoint->by_size());
    return true;
  }
  /// λ at the end of the run.
  void begin(const phs::State& end) {
    begun_ = true;
    end_ = end;
    for (Descent& d : descents_) {
      if (!d.objective.end) continue;
      add_cost(d, d.objective.end, method_.time(end), end.x, end.turns, 1);
      for (size_t k = 0; k < n_; ++k) d.lambda.add(k, gradient_[k]);
      d.size_at_end = size_of(d.lambda.x);
    }
  }
  /// Adds weight · a part of a cost to it, and leaves its gradient in gradient_.
  /// @return what it added
  double add_cost(Descent& d, const Objective::Part& part, double t, std::span<const double> x,
                  const std::vector<std::int64_t>& turns, double weight) {
    std::copy(x.begin(), x.end(), x_.begin());
    for (size_t a = 0; a < angle_at_.size(); ++a)
      x_[angle_at_[a]] += double(turns[a]) * phs::two_pi_hi;
    std::fill(gradient_.begin(), gradient_.end(), 0.0);
    const double added = weight * part(t, x_, gradient_);
    d.cost.add(0, added);
    return added;
  }
  bool give_up(Outcome o, const std::string& why) {
    outcome_ = o;
    remark_ = why;
    return false;
  }
  /// Its length, also where the squares leave the range of numbers.
  static double size_of(const std::vector<double>& v) {
    double largest = 0, sum = 0;
    for (const double a : v) largest = std::max(largest, std::fabs(a));
    if (largest == 0) return 0;
    for (const double a : v) sum += (a / largest) * (a / largest);
    return largest * std::sqrt(sum);
  }

  struct TurnsFrom {
    size_t from;  ///< the first step of the segment with them
    std::vector<std::int64_t> turns;
  };

  const GradientOptions& options_;
  StepPieces pieces_;
  Integrator& method_;
  std::vector<Descent> descents_;
  size_t n_;
  bool autonomous_;
  std::vector<double> weights_;
  std::vector<size_t> angle_at_;

  std::int64_t segment_ = 0, fan_ = 0, done_ = 0, whole_until_ = 0;
  double work_ = 1;
  int levels_ = 0;
  phs::State state_, end_;
  std::vector<double> kept_;  ///< rows of a segment
  std::vector<TurnsFrom> turns_;

  std::vector<double> x_, gradient_, running_;
  bool begun_ = false;
  Outcome outcome_ = Outcome::ok;
  std::string remark_;
};

}  // namespace

std::vector<RunGradient> gradients_of_run(const std::string& method, const phs::Model& model,
                                          const phs::State& start, double h, std::int64_t steps,
                                          std::span<const Objective> objectives,
                                          const GradientOptions& options) {
  if (steps < 0)
    throw InvalidArgument("steps is " + std::to_string(steps) + ", expected steps >= 0");
  require_size("x", start.x.size(), size_t(model.description().nx));
  return Backwards(method, model, h, objectives, options).of(start, steps);
}

RunGradient gradient_of_run(const std::string& method, const phs::Model& model,
                            const phs::State& start, double h, std::int64_t steps,
                            const Objective& objective, const GradientOptions& options) {
  return gradients_of_run(method, model, start, h, steps, {&objective, 1}, options).front();
}

}  // namespace porthos::integrators
