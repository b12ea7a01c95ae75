#pragma once
#include <memory>
#include <vector>

#include "phs/system/system.h"

namespace porthos::ensemble {

/// A model whose inputs are held. Its parameters (phs/system/tunable.h) are the nu inputs u of its
/// ports, initially 0. Their work is booked as the power "inputs". The plant's declared invariants
/// are dropped, because inputs change them.
class HeldInputs : public phs::ModelFor<HeldInputs> {
 public:
  explicit HeldInputs(std::shared_ptr<const phs::Model> plant);
  const phs::Description& description() const override { return description_; }
  std::vector<phs::HoldPtr> holds() const override { return plant_->holds(); }
  const phs::Model& plant() const { return *plant_; }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

 private:
  template <class T>
  class Evaluator;
  std::shared_ptr<const phs::Model> plant_;
  phs::Description description_;
};

}  // namespace porthos::ensemble
