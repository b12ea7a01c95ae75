#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/closed_loop.h"

namespace porthos::energy_shaping {

/// The plant under a law, as a model for any integrator, either continuous or with held inputs.
/// Coordinates are not wrapped, because laws need not be periodic. Its energy is the plant's; the
/// work of the actuators is the power "actuators". Keeps references to the loop and the plant.
class DrivenPlant : public phs::ModelFor<DrivenPlant> {
 public:
  /// limits: largest |u| of each actuated input, in the order of loop.actuated(); empty: none.
  /// held: one number per input of the plant, read at every evaluation; null: the law itself.
  DrivenPlant(const ClosedLoop& loop, const phs::Model& plant, std::vector<double> limits = {},
              std::shared_ptr<const std::vector<double>> held = nullptr);
  const phs::Description& description() const override { return description_; }
  std::vector<phs::HoldPtr> holds() const override { return plant_.holds(); }
  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

 private:
  template <class T>
  class Evaluator;
  const ClosedLoop& loop_;
  const phs::Model& plant_;
  std::vector<double> limits_;
  std::shared_ptr<const std::vector<double>> held_;
  phs::Description description_;
};

/// @throws InvalidArgument unless there are none, or one above 0 for each of loop.actuated()
void check_limits(const ClosedLoop& loop, const std::vector<double>& limits);

/// The run of a closed loop: method, length, sampling.
struct RunOptions {
  double duration = 10;  ///< [s]
  double step = 0.01;    ///< of the integrator [s]
  std::string method = "gauss8";
  double period = 0;                ///< of the controller [s], a multiple of step; 0: continuous
  std::vector<double> limits = {};  ///< as DrivenPlant
  const phs::Model* plant =
      nullptr;        ///< a plant other than that of the loop; null: the loop's plant
  double record = 0;  ///< between records [s]; 0: every step
};

/// A simulated run of the *plant* under the law.
struct Run {
  std::vector<double> t, H;            ///< H_d at the records
  std::vector<std::vector<double>> x;  ///< states at the records
  std::vector<std::vector<double>> u;  ///< actuated inputs at the records
  std::vector<double> peak;            ///< largest |u| of each actuated input, over all steps
  double rise = 0;                     ///< largest rise of H_d over a step [J]
  double dissipated =
      0;  ///< ∫ ∂H_dᵀ R_d ∂H_d dt, by Simpson's rule over pairs of steps, trapezoids at an odd end
  double quadrature =
      0;  ///< Simpson's rule against trapezoids: bounds the error of `dissipated` [J]
  double injected =
      0;  ///< H_d(end) - H_d(0) + dissipated: what sampling, limits and another plant put in [J]
  /// false: the integrator failed, gave non-finite numbers, or the law is not meant for the last
  /// state (ClosedLoop::hindrance)
  bool finished = true;
  std::string outcome = "ok";  ///< of a run that did not finish: why
};
/// @throws InvalidArgument for a period that is no multiple of the step, or sizes that do not fit
Run simulate(const ClosedLoop& loop, const std::vector<double>& x0, const RunOptions& options);

}  // namespace porthos::energy_shaping
