#pragma once
#include <memory>
#include <span>
#include <vector>

#include "phs/functions/law.h"
#include "phs/scalars/scalar.h"

namespace porthos::phs {

/// The sampling instants of a model's controllers in duals, for derivatives of runs. One object per
/// thread.
class Instants {
 public:
  virtual ~Instants() = default;
  /// Of the law of hold i, with the controller's name before each.
  virtual std::vector<LawGain> gains(size_t i) const = 0;
  /// As System::set_turn_angles.
  virtual void set_turn_angles(std::span<const Dual> angles) = 0;
  /// How many outputs of the system that law sees.
  virtual size_t flows(size_t i) const = 0;
  /// System::sample() with these gains, and with these changes added to the outputs it sees.
  virtual void sample(size_t i, std::span<const Dual> gains, const Dual& t, std::span<const Dual> x,
                      std::span<const Dual> changes, std::span<Dual> memory) = 0;
};

/// A second base class of a model with sampled controllers.
class WithInstants {
 public:
  virtual ~WithInstants() = default;
  /// It must not outlive the model.
  /// @throws InvalidArgument for a law without derivatives, by its name
  virtual std::unique_ptr<Instants> instants() const = 0;
};

}  // namespace porthos::phs
