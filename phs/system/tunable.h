#pragma once
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "phs/system/system.h"

/// Numbers of a system that differ between runs of the same model: gains, masses, inputs held for a
/// while.
namespace porthos::phs {

/// A second base class of an evaluator (System<T>) that has such numbers. In lanes, each lane may
/// have its own.
template <class T>
class Tunable {
 public:
  virtual ~Tunable() = default;
  /// The numbers this object uses, for reading and writing. Their count is constant.
  virtual std::span<T> parameters() = 0;
};

/// The parameters of an evaluator; empty if it has none.
template <class T>
std::span<T> parameters_of(System<T>& s) {
  auto* tunable = dynamic_cast<Tunable<T>*>(&s);
  return tunable ? tunable->parameters() : std::span<T>();
}

/// A model with given parameter values: the model of one run. It refers to the model, which must
/// outlive it.
class TunedModel : public ModelFor<TunedModel> {
 public:
  /// @throws InvalidArgument if the model has another number of parameters
  TunedModel(const Model& model, std::vector<double> values)
      : model_(model), values_(std::move(values)) {
    const auto one = model.instantiate<double>();
    require_size("parameters", values_.size(), parameters_of(*one).size());
  }
  const Description& description() const override { return model_.description(); }
  std::vector<HoldPtr> holds() const override { return model_.holds(); }
  template <class T>
  std::unique_ptr<System<T>> make_system() const {
    auto s = model_.instantiate<T>();
    const auto to = parameters_of(*s);
    for (size_t i = 0; i < to.size(); ++i) to[i] = T(values_[i]);
    return s;
  }

 private:
  const Model& model_;
  std::vector<double> values_;
};

}  // namespace porthos::phs
