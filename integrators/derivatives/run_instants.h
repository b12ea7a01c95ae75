#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/run_model.h"
#include "integrators/derivatives/step_variation.h"
#include "phs/system/instants.h"

namespace porthos::integrators {

/// The derivative of a run at the instants of its sampled controllers. What they remember, m, of
/// which the first numbers are the held ones w, is a part of the run's state. With m' = S(x, m, g,
/// y(x, θ)), g the gains, y the outputs that laws see, θ the parameters, and a step x' = Φ(x, w),
///
///   tangent   δm' = S_x δx + S_m δm,     δx' = Φ_x δx + Φ_w δw
///   adjoint   μ' += Φ_wᵀ λ',  λ = Φ_xᵀ λ' + S_xᵀ μ',  μ = S_mᵀ μ',
///             ∂g += S_gᵀ μ',  ∂θ += y_θᵀ S_yᵀ μ'
///
/// where S_x contains S_y y_x. S is differentiated by duals: an evaluation of the law for each
/// number. One object per thread.
class RunInstants {
 public:
  /// @param model  of a run, which must outlive it; without sampled controllers there are none
  /// @throws InvalidArgument for a law without derivatives, by its name
  explicit RunInstants(const phs::Model& model);

  bool any() const { return !holds_.empty(); }
  /// Numbers of all memories, and the held ones among them.
  size_t memories() const { return memory_.size(); }
  size_t values() const { return values_.size(); }
  const std::vector<phs::LawGain>& gains() const { return gains_; }
  /// The parameters of a step without the held values, and the gains.
  std::vector<std::string> names(std::vector<std::string> parameters) const;
  /// @throws InvalidArgument if a step has no derivatives by what is held
  void require(const std::vector<std::string>& parameters, const std::string& method) const;

  /// Numbers of a step that keep() writes.
  size_t size() const { return any() ? holds_.size() + 2 * memories() + n_ : 0; }
  /// What the controllers did at the start of a step of the method, which began at `before`.
  /// @param turns  of the angles, after the step
  void keep(Integrator& method, const phs::State& before, const std::vector<std::int64_t>& turns,
            std::span<double> to) const;
  /// Moves to such a step, from time t: the evaluators of the run read what was held in it.
  void at(std::span<const double> kept, const std::vector<std::int64_t>& turns, double t);

  /// Of a cost by what is remembered, and by the gains.
  struct Adjoint {
    TwoWords memory, gains;
  };
  Adjoint adjoint() const { return {TwoWords(memories()), TwoWords(gains_.size())}; }
  /// From the start of a step, after its instants, to before them.
  /// @param parameters  its last numbers are those by the held values, which are taken from it
  void back(TwoWords& lambda, TwoWords& parameters, Adjoint& v);
  /// The other way, of a tangent δx: δm, which holds through the step.
  void forwards(std::span<const double> dx, std::span<double> dm) const;
  /// Adds what a parameter changes, by systems with the parameter a short way up and down.
  void add_difference(phs::System<double>& up, phs::System<double>& down, double distance,
                      std::span<double> dm) const;
  /// δw of it.
  void held(std::span<const double> dm, std::span<double> dw) const;

 private:
  /// The place of a hold in all memories and gains, and its Jacobian by (x, m, g, y), row by row.
  struct Hold {
    size_t at, size, gain, gains, flows;
    bool renewed = false;
    std::vector<double> jacobian = {};
  };
  size_t columns(const Hold& h) const { return n_ + h.size + h.gains + h.flows; }
  void differentiate(size_t i);

  const RunModel* run_;
  std::unique_ptr<phs::Instants> instants_;
  std::unique_ptr<phs::Linearised<double>> linear_;  ///< at the start of that step
  size_t n_;
  std::vector<Hold> holds_;
  std::vector<double> memory_, x_;  ///< before the instants of the step that at() was called for
  double t_ = 0;
  std::vector<size_t> values_;  ///< places of the held values in it
  std::vector<phs::LawGain> gains_;
  std::vector<size_t> angles_;  ///< their places in the state
  std::vector<phs::Dual> turns_, seeds_, to_;
  std::vector<double> field_, angles_told_, weights_, by_flows_;
};

/// The gains of a model's sampled laws that a run has derivatives by.
/// @throws InvalidArgument as RunInstants
std::vector<phs::LawGain> gains_of_run(const phs::Model& model);

}  // namespace porthos::integrators
