#pragma once
#include <memory>
#include <utility>
#include <vector>

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
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const {
    auto system = model_.instantiate<T>();
    system->use_held(std::vector<phs::HeldPtr>(memories_.begin(), memories_.end()));
    return system;
  }
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

}  // namespace porthos::integrators
