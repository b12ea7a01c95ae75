#pragma once
#include <span>

#include "integrators/core/integrator.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// A method whose steps are given by their stages Y_i:
///   L_i = h b_i f(Y_i),   Y_i = y + Σ_j μ_ij L_j,   y' = y + Σ_i L_i
/// The derivative of a step is taken there (integrators/derivatives/).
template <class T>
class StagedSteps {
 public:
  virtual ~StagedSteps() = default;
  virtual CollocationTable<TableReal<T>> table() const = 0;
  /// Writes the stages of the last step, which ended in `after`, one after another: s · nx numbers,
  /// with the angles before their wrapping, and then the multipliers.
  virtual void stages(const phs::BasicState<T>& after, std::span<T> Y) const = 0;
  /// Further numbers of a step: of Störmer-Verlet one for each quaternion, the multiplier of the
  /// forces along it in the first stage.
  virtual size_t multipliers() const { return 0; }
};

/// A method without such stages, whose step depends on the state alone: its derivative is that of
/// the method in duals. In the place of stages are the states before and after a step, with the
/// weights of the trapezoidal rule.
template <class T>
class StepsByDuals : public StagedSteps<T> {
 public:
  CollocationTable<TableReal<T>> table() const final { return lobatto_table<TableReal<T>>(2); }
};

}  // namespace porthos::integrators
