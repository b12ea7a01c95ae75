#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "phs/system/linearised.h"
#include "phs/system/system.h"

namespace porthos::integrators {

/// A model for one run: its evaluators read the values that the sampled controllers hold in this
/// run. The underlying model must outlive it.
class RunModel final : public phs::ModelFor<RunModel> {
 public:
  using Memory = std::shared_ptr<std::vector<double>>;

  explicit RunModel(const phs::Model& model) : model_(model) {
    for (const auto& hold : model.holds())
      memories_.push_back(std::make_shared<std::vector<double>>(hold->fresh));
  }
  /// A part of `whole` with the same sampled controllers.
  RunModel(const phs::Model& part, const RunModel& whole)
      : model_(part), memories_(whole.memories_) {}
  const phs::Description& description() const override { return model_.description(); }
  std::vector<phs::HoldPtr> holds() const override { return model_.holds(); }
  std::vector<phs::HeldPtr> held() const { return {memories_.begin(), memories_.end()}; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    auto system = model_.instantiate<T>();
    system->use_held(held());
    return system;
  }
  const phs::Model& model() const { return model_; }
  /// One for each of holds().
  const std::vector<Memory>& memories() const { return memories_; }

 private:
  const phs::Model& model_;
  std::vector<Memory> memories_;
};

/// The model of a run, and its owner. A model without sampled controllers is used as it is. So is
/// one that already belongs to a run (the method inside a step control).
struct OfRun {
  explicit OfRun(const phs::Model& m) : model(&m) {
    if (m.holds().empty() || dynamic_cast<const RunModel*>(&m)) return;
    kept = std::make_shared<RunModel>(m);
    model = kept.get();
  }
  const phs::Model* model;
  std::shared_ptr<const RunModel> kept;
};

/// The derivative of the field of a run's model, with the values that its sampled controllers hold
/// in that run.
/// @throws InvalidArgument as phs::linearise(); for sampled controllers in a model that is no
///   RunModel
template <class T>
std::unique_ptr<phs::Linearised<T>> linearise_run(const phs::Model& model) {
  if (const auto* run = dynamic_cast<const RunModel*>(&model))
    return phs::linearise<T>(model, run->held());
  return phs::linearise<T>(model);
}

}  // namespace porthos::integrators
