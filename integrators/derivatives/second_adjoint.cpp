#include "integrators/derivatives/second_adjoint.h"

#include "integrators/core/turns.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
namespace {

class CollocationSecond final : public SecondAdjoint {
  using Duals = phs::WideDual;
  using Lanes = decltype(Duals::v);
  static constexpr int V = phs::lanes<Lanes>;

 public:
  CollocationSecond(const phs::Model& model, const StepPieces& pieces)
      : n_(size_t(model.description().nx)),
        table_(pieces.table()),
        adjoint_(make_step_variation(model, table_, StepVariation::Side::adjoint)),
        turns_(model.description()),
        weights_(size_t(table_.s)),
        first_(weights_.size() * n_),
        changes_(first_.size()),
        source_(first_.size()),
        x_(n_),
        f_(n_),
        out_(n_) {
    for (size_t i = 0; i < weights_.size(); i += V)
      fields_.push_back(phs::linearise_in_duals(model));
    gradient_.resize(adjoint_->parameters().size());
  }

  Outcome advance(const StepPiece& step, const std::vector<std::int64_t>& turns,
                  std::span<const double> tangent, const StepVariation& first,
                  std::span<const double> running, TwoWords& v) override {
    h_ = step.h;
    turns_.when_changed(turns, [&](std::span<const Duals> angles) {
      for (auto& field : fields_) field->set_turn_angles(angles);
    });
    first.stages(first_);
    std::fill(changes_.begin(), changes_.end(), 0.0);
    for (size_t c = 0; c < fields_.size(); ++c) {
      Lanes time(0.0);
      for (int l = 0; l < V; ++l) time.set(l, step.t + h_ * table_.c[stage(c, l)]);
      gather(c, step.Y, tangent);
      fields_[c]->at(Duals(time), x_, f_);
      multiply(c);
      for (int l = 0; l < V; ++l)
        for (size_t k = 0; k < n_; ++k) source_[stage(c, l) * n_ + k] = out_[k].d[l];
    }
    for (size_t i = 0; i < running.size(); ++i) source_[i] += running[i];
    adjoint_->at(step, turns);
    const Outcome o = adjoint_->advance(v, source_);
    if (o == Outcome::ok) adjoint_->stages(changes_);
    return o;
  }

  void add_gradient(TwoWords& gradient) override {
    if (gradient_.empty()) return;
    std::fill(gradient_.begin(), gradient_.end(), Duals(0.0));
    table_.weights(h_, weights_);
    for (size_t c = 0; c < fields_.size(); ++c) {
      multiply(c);
      Lanes weight(0.0);
      for (int l = 0; l < V && c * V + size_t(l) < weights_.size(); ++l)
        weight.set(l, weights_[stage(c, l)]);
      fields_[c]->add_gradient(Duals(weight), gradient_);
    }
    for (size_t a = 0; a < gradient_.size(); ++a) {
      double sum = 0;
      for (int l = 0; l < V; ++l) sum += gradient_[a].d[l];
      gradient.add(a, sum);
    }
  }

 private:
  /// Lanes beyond the last stage repeat it.
  size_t stage(size_t c, int l) const { return std::min(c * V + size_t(l), weights_.size() - 1); }
  /// Stages of a chunk, with their changes, into x_.
  void gather(size_t c, std::span<const double> values, std::span<const double> changes) {
    for (int l = 0; l < V; ++l) {
      const size_t from = stage(c, l) * n_;
      for (size_t k = 0; k < n_; ++k) {
        x_[k].v.set(l, values[from + k]);
        x_[k].d.set(l, changes[from + k]);
      }
    }
  }
  /// out_ = Dfᵀ (ℓ + ε δℓ) at a chunk's stages.
  void multiply(size_t c) {
    gather(c, first_, changes_);
    fields_[c]->transpose_times(x_, out_);
  }

  size_t n_;
  CollocationTable<double> table_;
  std::unique_ptr<StepVariation> adjoint_;
  TurnKeeper<Duals> turns_;
  double h_ = 0;
  std::vector<double> weights_, first_, changes_, source_;  ///< ℓ, δℓ
  std::vector<Duals> x_, f_, out_, gradient_;
  std::vector<std::unique_ptr<phs::Linearised<Duals>>> fields_;  ///< a chunk of stages each
};

}  // namespace

std::unique_ptr<SecondAdjoint> make_second_adjoint(const phs::Model& model,
                                                   const StepPieces& pieces) {
  if (pieces.multipliers() > 0)
    throw InvalidArgument(
        "a direction of second derivatives is not there for Stormer-Verlet with quaternions, "
        "expected Gauss collocation");
  return std::make_unique<CollocationSecond>(model, pieces);
}

}  // namespace porthos::integrators
