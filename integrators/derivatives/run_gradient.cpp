#include "integrators/derivatives/run_gradient.h"

#include <algorithm>
#include <cmath>

#include "integrators/derivatives/replay.h"
#include "integrators/derivatives/second_adjoint.h"

namespace porthos::integrators {
namespace {

/// One cost on its way back through the run, and with a direction its change along that.
struct Descent {
  const Objective& objective;
  std::unique_ptr<StepVariation> adjoint;
  std::unique_ptr<SecondAdjoint> second;
  TwoWords lambda, parameters, cost;
  RunInstants::Adjoint held;  ///< of what the sampled controllers remember
  TwoWords by_size;           ///< Σ h ∂J/∂h of the steps
  TwoWords lambda_along, parameters_along;
  double size_at_end = 0;

  Descent(const Objective& J, const phs::Model& model, const StepPieces& pieces,
          const RunInstants& instants, const GradientOptions& options)
      : objective(J),
        adjoint(make_step_variation(model, pieces, StepVariation::Side::adjoint)),
        second(options.has_direction()
                   ? make_second_adjoint(model, pieces, options.parameter_direction)
                   : nullptr),
        lambda(size_t(model.description().nx)),
        parameters(adjoint->parameters().size()),
        cost(1),
        held(instants.adjoint()),
        by_size(1),
        lambda_along(lambda),
        parameters_along(parameters) {
    instants.require(adjoint->parameters(), pieces.method().declaration().name);
  }
};

/// A run backwards, for any number of costs.
class Backwards final : public Replay {
 public:
  Backwards(const std::string& method, const phs::Model& model, double h,
            std::span<const Objective> objectives, const GradientOptions& options)
      : Replay(method, model, h, options),
        n_(size_t(model.description().nx)),
        autonomous_(model.description().traits.autonomous),
        weights_(size_t(pieces().table().s)),
        x_(n_),
        gradient_(n_),
        gradient_along_(n_) {
    for (const Objective& J : objectives)
      descents_.emplace_back(J, model, pieces(), instants(), options);
    for (const auto& b : model.description().blocks)
      if (b.kind == phs::BlockKind::angle) angle_at_.push_back(size_t(b.at));
  }

  std::vector<RunGradient> of(const phs::State& start, std::int64_t steps) {
    const bool ok = take(start, steps, descents_.size());
    std::vector<RunGradient> all;
    for (const Descent& d : descents_) {
      RunGradient r;
      r.outcome = ok ? Outcome::ok : outcome();
      r.remark = remark();
      r.cost = d.cost.x[0];
      r.end = end_;
      r.start = d.lambda.x;
      r.names = instants().names(d.adjoint->parameters());
      r.parameters = d.parameters.x;
      r.parameters.resize(r.parameters.size() - instants().values());
      r.parameters.insert(r.parameters.end(), d.held.gains.x.begin(), d.held.gains.x.end());
      r.duration =
          autonomous_ && !instants().any() && length() != 0 ? d.by_size.x[0] / length() : NAN;
      const double size = size_of(d.lambda.x);
      r.growth = !d.objective.end ? NAN : size == 0 ? 0 : std::log10(size / d.size_at_end);
      if (d.second) {
        r.start_along = d.lambda_along.x;
        r.parameters_along = d.parameters_along.x;
      }
      r.steps_taken = pieces().method().cost().steps;
      r.adjoint = d.adjoint->cost();
      all.push_back(std::move(r));
    }
    return all;
  }

 private:
  void begin(const phs::State& end, std::span<const double> tangent) override {
    end_ = end;
    for (Descent& d : descents_) {
      if (!d.objective.end) continue;
      add_cost(d, d.objective.end, d.objective.end_curvature,
               {pieces().method().time(end), end.x, tangent, end.turns}, 1);
      add_to_lambda(d);
      d.size_at_end = size_of(d.lambda.x);
    }
  }
  bool back(const KeptStep& step) override {
    instants().at(step.instant, step.turns, pieces().at(step.pieces, 0).t);
    return std::ranges::all_of(descents_, [&](Descent& d) { return back(d, step); });
  }
  /// Takes a cost back over a step.
  bool back(Descent& d, const KeptStep& step) {
    if (!went_on()) return false;
    const size_t count = step.pieces.size() / pieces().size(), stages = step.tangent.size() / count;
    if (d.objective.sampled) {
      const StepPiece last = pieces().at(step.pieces, count - 1);
      add_cost(d, d.objective.sampled, d.objective.sampled_curvature,
               {last.t + last.h, step.end, step.tangent_at_end, step.turns}, 1);
      add_to_lambda(d);
    }
    for (size_t i = count; i-- > 0;)
      if (!back_over(d, pieces().at(step.pieces, i), step.tangent.subspan(i * stages, stages),
                     step.turns))
        return false;
    instants().back(d.lambda, d.parameters, d.held);
    return true;
  }
  bool back_over(Descent& d, const StepPiece& piece, std::span<const double> tangent,
                 const std::vector<std::int64_t>& turns) {
    const auto& table = pieces().table();
    const auto& part = d.objective.running;
    const size_t s = weights_.size();
    running_.resize(part ? s * n_ : 0);
    running_along_.resize(d.second ? running_.size() : 0);
    if (part) table.weights(piece.h, weights_);
    for (size_t j = 0; j < s && part; ++j) {
      const auto at = [&](std::span<const double> values) {
        return values.empty() ? values : values.subspan(j * n_, n_);
      };
      d.by_size.add(0, add_cost(d, part, d.objective.running_curvature,
                                {piece.t + piece.h * table.c[j], at(piece.Y), at(tangent), turns},
                                weights_[j]));
      std::ranges::copy(gradient_, running_.begin() + std::ptrdiff_t(j * n_));
      if (d.second)
        std::ranges::copy(gradient_along_, running_along_.begin() + std::ptrdiff_t(j * n_));
    }
    d.adjoint->at(piece, turns);
    Outcome o = d.adjoint->advance(d.lambda, running_);
    if (o == Outcome::ok && d.second)
      o = d.second->advance(piece, turns, tangent, *d.adjoint, running_along_, d.lambda_along);
    if (o != Outcome::ok)
      return give_up(o, "the adjoint of the step at t = " + number(piece.t) + " s: " +
                            (o == Outcome::not_converged
                                 ? "its iteration does not contract, expected a shorter step"
                                 : "it outgrew every number, expected a shorter run"));
    d.adjoint->add_gradient(d.parameters);
    if (d.second) d.second->add_gradient(d.parameters_along);
    d.by_size.add(0, d.adjoint->by_size());
    return true;
  }

  /// A point that a cost is asked at, with the tangent there.
  struct Point {
    double t;
    std::span<const double> x, tangent;
    const std::vector<std::int64_t>& turns;
  };
  /// Adds weight · a part of a cost to it, and leaves its gradient in gradient_, the change of that
  /// along the tangent in gradient_along_.
  /// @return what it added
  double add_cost(Descent& d, const Objective::Part& part, const Objective::Curvature& curvature,
                  const Point& at, double weight) {
    std::ranges::copy(at.x, x_.begin());
    for (size_t a = 0; a < angle_at_.size(); ++a)
      x_[angle_at_[a]] += double(at.turns[a]) * phs::two_pi_hi;
    if (d.second) {
      std::ranges::fill(gradient_along_, 0.0);
      if (curvature)
        curvature(at.t, x_, at.tangent, gradient_along_);
      else
        difference_along(part, at.t, at.tangent);
    }
    std::ranges::fill(gradient_, 0.0);
    const double added = weight * part(at.t, x_, gradient_);
    d.cost.add(0, added);
    return added;
  }
  /// gradient_along_ of a part at x_, by a central difference of its gradient.
  void difference_along(const Objective::Part& part, double t, std::span<const double> tangent) {
    const double length = size_of(tangent), by = 0x1p-17 * (1 + size_of(x_)) / length;
    if (length == 0) return;
    moved_.resize(n_);
    for (const double way : {by, -by}) {
      for (size_t k = 0; k < n_; ++k) moved_[k] = x_[k] + way * tangent[k];
      std::ranges::fill(gradient_, 0.0);
      (void)part(t, moved_, gradient_);
      for (size_t k = 0; k < n_; ++k) gradient_along_[k] += gradient_[k] / (2 * way);
    }
  }
  void add_to_lambda(Descent& d) {
    for (size_t k = 0; k < n_; ++k) d.lambda.add(k, gradient_[k]);
    for (size_t k = 0; k < n_ && d.second; ++k) d.lambda_along.add(k, gradient_along_[k]);
  }
  /// Its length, also where the squares leave the range of numbers.
  static double size_of(std::span<const double> v) {
    double largest = 0, sum = 0;
    for (const double a : v) largest = std::max(largest, std::fabs(a));
    if (largest == 0) return 0;
    for (const double a : v) sum += (a / largest) * (a / largest);
    return largest * std::sqrt(sum);
  }

  std::vector<Descent> descents_;
  size_t n_;
  bool autonomous_;
  std::vector<double> weights_;
  std::vector<size_t> angle_at_;
  phs::State end_;
  std::vector<double> x_, moved_, gradient_, gradient_along_, running_, running_along_;
};

}  // namespace

std::vector<RunGradient> gradients_of_run(const std::string& method, const phs::Model& model,
                                          const phs::State& start, double h, std::int64_t steps,
                                          std::span<const Objective> objectives,
                                          const GradientOptions& options) {
  if (steps < 0)
    throw InvalidArgument("steps is " + std::to_string(steps) + ", expected steps >= 0");
  require_size("x", start.x.size(), size_t(model.description().nx));
  if (!options.taken.empty() && (std::int64_t(options.taken.size()) != steps || options.last != 0))
    throw InvalidArgument("steps is " + std::to_string(steps) + " with " +
                          std::to_string(options.taken.size()) +
                          " taken steps, expected their number, and no last step besides");
  const OfRun run(model);
  return Backwards(method, *run.model, h, objectives, options).of(start, steps);
}

RunGradient gradient_of_run(const std::string& method, const phs::Model& model,
                            const phs::State& start, double h, std::int64_t steps,
                            const Objective& objective, const GradientOptions& options) {
  return gradients_of_run(method, model, start, h, steps, {&objective, 1}, options).front();
}

}  // namespace porthos::integrators
