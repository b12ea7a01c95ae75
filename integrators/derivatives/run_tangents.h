#pragma once
#include "integrators/derivatives/run_instants.h"

namespace porthos::integrators {

/// A direction that a run may change along: in its start, and in its parameters z by two models a
/// short way up and down.
struct Along {
  std::vector<double> start;                        ///< ∂x_0/∂z, size nx
  const phs::Model *up = nullptr, *down = nullptr;  ///< null: of the start alone
  double distance = 0;  ///< from the model of the run to each of the two, in z
};

/// A run with its tangents, ∂x/∂z at fixed time:
///
///   δL_i = h b_i (Df(Y_i) δY_i + ∂f/∂z (Y_i)),   δY_i = δy + Σ μ_ij δL_j
///
/// A tangent is that of the step, to rounding; ∂f/∂z is the central difference of the two models'
/// fields at its stages, which takes every parameter there is. With distances near the cube root of
/// rounding it is known to some 1e-10. What sampled controllers remember is a part of the tangent
/// (RunInstants). A composition has this in each of its steps. Cost of a direction: about 7 fields
/// at every stage, and two for its models.
class RunTangents {
 public:
  /// The models must outlive it, and have the states of `model`.
  /// @throws InvalidArgument as StepPieces, phs::linearise() and RunInstants; for a direction of
  ///   parameters, and for sampled controllers, of Störmer-Verlet with quaternions, whose
  ///   multipliers depend on them, and of discrete gradients and splittings
  RunTangents(const std::string& method, const phs::Model& model, phs::State start, double h,
              std::vector<Along> directions);

  /// A step of the run and of all tangents. @return if not ok, remark() says where
  [[nodiscard]] Outcome step();
  const std::string& remark() const { return remark_; }

  const phs::State& state() const { return state_; }
  double time() const { return pieces_.method().time(state_); }
  size_t size() const { return tangents_.size(); }
  /// Tangent k of the state.
  TwoWords& tangent(size_t k) { return tangents_[k].value; }
  const TwoWords& tangent(size_t k) const { return tangents_[k].value; }
  /// The state at the fraction theta of the last step, size nx, and its tangent k. For methods of
  /// one piece.
  void interpolate(double theta, std::span<double> x) const;
  void interpolate(size_t k, double theta, std::span<double> tangent) const {
    tangents_[k].variation->interpolate(tangents_[k].value, theta, tangent);
  }

 private:
  struct Tangent {
    double distance;
    std::unique_ptr<RunModel> up_model, down_model;
    std::unique_ptr<phs::System<double>> up, down;
    std::unique_ptr<StepVariation> variation;
    TwoWords value;
    std::vector<double> memory;  ///< of the sampled controllers
  };
  void over_instants(const phs::State& before, double t);
  Outcome fail(Outcome o, const char* what, double t);
  std::span<const double> field_changes(Tangent& tangent, const StepPiece& piece);

  OfRun run_;
  StepPieces pieces_;
  RunInstants instants_;
  std::unique_ptr<phs::Linearised<double>> held_field_;  ///< null without sampled controllers
  phs::State state_;
  size_t n_;
  std::vector<double> changes_, down_, angles_, kept_, held_;
  std::vector<Tangent> tangents_;
  std::string remark_;
};

}  // namespace porthos::integrators
