#pragma once
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/sensitivity/inputs.h"

namespace porthos::scene {

/// What to ask about the end of a scene's run.
struct SensitivityRequest {
  std::vector<std::string> of = {};        ///< names as in EndQuantities; empty: the usual ones
  std::vector<std::string> by = {};        ///< inputs by name, as in Unknowns: by end_differences()
  std::optional<double> uncertainty = {};  ///< relative standard deviation of every parameter
  size_t memory = size_t(256) << 20;       ///< as integrators::GradientOptions
  int threads = 0;                         ///< of differences; 0: as many as the machine has
  const std::atomic<bool>* stop = nullptr;         ///< true: give up
  std::function<void(double done)> progress = {};  ///< the share of the work done, 0 to 1
};

/// A quantity at the end, and how it depends on each input.
struct EndSlopes {
  std::string name, unit;
  double value = 0;
  std::vector<double> slopes;       ///< ∂value/∂input, as EndSensitivity::inputs
  double growth = 0;                ///< integrators::RunGradient::growth; NaN by differences
  double error = 0;                 ///< of the slopes at the end, relative: EndQuantity::error
  std::vector<double> errors = {};  ///< of each slope by differences; empty by the adjoint

  /// Whether a slope differs from zero by more than its error.
  bool counts(size_t input) const {
    return std::fabs(slopes[input]) > (errors.empty() ? 0.0 : errors[input]);
  }
};

/// How the end of a run depends on its parameters and its start.
struct EndSensitivity {
  std::string title, method;
  double step = 0, last = 0, duration = 0;  ///< [s]; last: of a shorter last step, or 0
  std::int64_t chosen = 0;  ///< steps that a step control chose; 0: they are of one size
  std::vector<Input> inputs;
  std::vector<EndSlopes> of;
  std::optional<double> uncertainty;
  std::int64_t runs = 0;  ///< that differences were taken of; 0: by the adjoint
  std::vector<std::string> notes;
  std::string failure;  ///< of a step or its adjoint: where and why; then `of` is empty

  /// The change of a quantity by the whole of an input, slope × value: the slope by its logarithm.
  /// NaN of turns.
  double by_whole(const EndSlopes& q, size_t input) const {
    return q.slopes[input] * inputs[input].value + 0.0;  // no negative zeros
  }
  /// The standard deviation of a quantity by that of all parameters, independent of each other.
  double deviation(const EndSlopes& q) const;
  /// Parameters or start values with a slope that counts, largest effect first: of parameters
  /// |by_whole|, of start values |slope|.
  std::vector<size_t> sorted(const EndSlopes& q, bool start) const;
};

/// Slopes of the end of a scene's run, by one run and an adjoint for each quantity
/// (integrators::gradients_of_run); across its events by EventRun; with `by` end_differences().
/// They do not depend on whether the centre of mass is taken out: here it stays. Over many Lyapunov
/// times they are exact and useless: EndSlopes::growth.
/// @throws InvalidArgument as differentiable_steps(), EventRun, EndQuantities::require(),
///   phs::linearise(), for [[actuator]]s and for an uncertainty that is no positive number
EndSensitivity end_sensitivity(const Scene& scene, const SensitivityRequest& request);

/// The table: `most` rows of each kind for each quantity, with the unit in words.
std::string sensitivity_text(const EndSensitivity& s, size_t most = 6);
/// sensitivity.json, and sensitivity.csv: a line for each quantity and input.
std::string sensitivity_json(const Scene& scene, const EndSensitivity& s);
std::string sensitivity_csv(const EndSensitivity& s);
/// Writes sensitivity.json, .csv, .txt and .svg. @throws IoError
void write_sensitivity(const std::string& folder, const Scene& scene, const EndSensitivity& s);

}  // namespace porthos::scene
