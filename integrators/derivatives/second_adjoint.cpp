#include "integrators/derivatives/second_adjoint.h"

#include "integrators/core/turns.h"
#include "phs/system/linearised.h"

namespace porthos::integrators {
/// The derivatives of the field in duals at all stages of a step, in lanes.
class FieldsInDuals {
 public:
  using Duals = phs::WideDual;
  using Lanes = decltype(Duals::v);
  static constexpr int V = phs::lanes<Lanes>;

  FieldsInDuals(const phs::Model& model, const StepPieces& pieces,
                std::span<const double> parameters)
      : n_(size_t(model.description().nx)),
        table_(pieces.table()),
        x_(n_),
        f_(n_),
        out_(n_),
        turns_(model.description()) {
    for (size_t i = 0; i < stages(); i += V) {
      fields_.push_back(phs::linearise_in_duals(model));
      if (parameters.empty()) continue;
      require_size("parameter_direction", parameters.size(), names().size());
      fields_.back()->along_parameters(parameters);
    }
  }
  size_t stages() const { return size_t(table_.s); }
  size_t numbers() const { return stages() * n_; }
  const std::vector<std::string>& names() const { return fields_.front()->parameters(); }

 protected:
  /// Moves to a step whose stages have these changes, or none, and calls then(c) for each chunk.
  template <class Then>
  void move_to(const StepPiece& step, const std::vector<std::int64_t>& turns,
               std::span<const double> changes, const Then& then) {
    turns_.when_changed(turns, [&](std::span<const Duals> angles) {
      for (auto& field : fields_) field->set_turn_angles(angles);
    });
    for (size_t c = 0; c < fields_.size(); ++c) {
      Lanes time(0.0);
      for (int l = 0; l < V; ++l) time.set(l, step.t + step.h * table_.c[stage(c, l)]);
      gather(c, step.Y, changes);
      fields_[c]->at(Duals(time), x_, f_);
      then(c);
    }
  }
  /// Lanes beyond the last stage repeat it.
  size_t stage(size_t c, int l) const { return std::min(c * V + size_t(l), stages() - 1); }
  /// Stages of a chunk, with their changes, into x_.
  void gather(size_t c, std::span<const double> values, std::span<const double> changes) {
    for (int l = 0; l < V; ++l) {
      const size_t from = stage(c, l) * n_;
      for (size_t k = 0; k < n_; ++k) {
        x_[k].v.set(l, values[from + k]);
        x_[k].d.set(l, changes.empty() ? 0 : changes[from + k]);
      }
    }
  }
  /// The second parts of a chunk's numbers, to all stages.
  void scatter(size_t c, const std::vector<Duals>& from, std::vector<double>& to) const {
    for (int l = 0; l < V; ++l)
      for (size_t k = 0; k < n_; ++k) to[stage(c, l) * n_ + k] = from[k].d[l];
  }

  size_t n_;
  CollocationTable<double> table_;
  std::vector<Duals> x_, f_, out_;
  std::vector<std::unique_ptr<phs::Linearised<Duals>>> fields_;  ///< a chunk of stages each

 private:
  TurnKeeper<Duals> turns_;
  friend class FieldChange;
};

namespace {

class CollocationSecond final : public SecondAdjoint, FieldsInDuals {
 public:
  CollocationSecond(const phs::Model& model, const StepPieces& pieces,
                    std::span<const double> parameters)
      : FieldsInDuals(model, pieces, parameters),
        adjoint_(make_step_variation(model, table_, StepVariation::Side::adjoint)),
        weights_(stages()),
        first_(numbers()),
        changes_(numbers()),
        source_(numbers()),
        gradient_(names().size()) {}

  Outcome advance(const StepPiece& step, const std::vector<std::int64_t>& turns,
                  std::span<const double> tangent, const StepVariation& first,
                  std::span<const double> running, TwoWords& v) override {
    h_ = step.h;
    first.stages(first_);
    std::fill(changes_.begin(), changes_.end(), 0.0);
    move_to(step, turns, tangent, [&](size_t c) {
      multiply(c);
      scatter(c, out_, source_);
    });
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
  /// out_ = Dfᵀ (ℓ + ε δℓ) at a chunk's stages.
  void multiply(size_t c) {
    gather(c, first_, changes_);
    fields_[c]->transpose_times(x_, out_);
  }

  std::unique_ptr<StepVariation> adjoint_;
  double h_ = 0;
  std::vector<double> weights_, first_, changes_, source_;  ///< ℓ, δℓ
  std::vector<Duals> gradient_;
};

}  // namespace

std::unique_ptr<SecondAdjoint> make_second_adjoint(const phs::Model& model,
                                                   const StepPieces& pieces,
                                                   std::span<const double> parameters) {
  if (!pieces.by_table())
    throw InvalidArgument(
        "a direction of second derivatives is not there for '" +
        pieces.method().declaration().name +
        "' (discrete gradients, splittings, Stormer-Verlet with quaternions), expected Gauss "
        "collocation");
  return std::make_unique<CollocationSecond>(model, pieces, parameters);
}

FieldChange::FieldChange(const phs::Model& model, const StepPieces& pieces,
                         std::span<const double> parameters)
    : fields_(std::make_unique<FieldsInDuals>(model, pieces, parameters)),
      changes_(fields_->numbers()) {}
FieldChange::~FieldChange() = default;

std::span<const double> FieldChange::at(const StepPiece& step,
                                        const std::vector<std::int64_t>& turns) {
  fields_->move_to(step, turns, {}, [&](size_t c) { fields_->scatter(c, fields_->f_, changes_); });
  return changes_;
}

}  // namespace porthos::integrators
