#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/derivatives/step_pieces.h"

namespace porthos::integrators {

/// Numbers of double length, x + lo.
struct TwoWords {
  std::vector<double> x, lo;

  explicit TwoWords(size_t n) : x(n, 0.0), lo(n, 0.0) {}
  explicit TwoWords(std::span<const double> values)
      : x(values.begin(), values.end()), lo(x.size(), 0.0) {}
  void add(size_t k, double d) { phs::compensated_add(x[k], lo[k], d); }
};

/// The derivative of a step of a collocation method, L_i = h b_i f(Y_i), Y_i = y + Σ μ_ij L_j:
///
///   tangent   δL_i = h b_i Df(Y_i) δY_i,                δY_i = δy + Σ μ_ij δL_j
///   adjoint   K_i = h b_i (Df(Y_i)ᵀ ℓ_i + ∂r(Y_i)),     ℓ_i = λ' + Σ μ_ji K_j,   λ = λ' + Σ K_i
///
/// λ = ∂J/∂y if λ' = ∂J/∂y' and J also has the running cost Σ h b_i r(Y_i). With its stages in
/// reverse order the adjoint is a step of the linear field Dfᵀλ + ∂r with the table transposed, of
/// Gauss methods the same table, μ_ji = μ_(s+1-i)(s+1-j). So both are solved like the step itself:
/// in lanes, to stagnation, from the polynomial of the step before (of the adjoint: the later one).
/// Where the iteration does not contract, as in a stiff step, the linear equations are solved by
/// LU, up to 2000 unknowns s · nx. Source: Sanz-Serna 2016, SIAM Rev. 58 (the adjoint of a
/// symplectic table). Störmer-Verlet is the Lobatto IIIA-IIIB pair of two stages; with quaternions
/// it has multipliers too (stormer_verlet_variation.h). Discrete gradients have a derivative of
/// their own (discrete_gradient_variation.h), splittings that of a whole step in duals
/// (dual_step_variation.h), semi_implicit_euler its own too.
///
/// One object per thread. advance() allocates nothing but for LU.
class StepVariation {
 public:
  enum class Side { tangent, adjoint };
  virtual ~StepVariation() = default;

  /// Moves to a step.
  /// @param turns  of the angles of its stages
  virtual void at(const StepPiece& step, const std::vector<std::int64_t>& turns) = 0;
  /// δy → δy', or λ' → λ. @return not_converged for a stiff step with too many unknowns; then v is
  /// unchanged
  /// @param v  size nx;  running: of the adjoint, ∂r at the stages, of a tangent what a change of
  ///   parameters adds to f there, size s · nx; empty: none
  [[nodiscard]] virtual Outcome advance(TwoWords& v, std::span<const double> running = {}) = 0;
  /// After a tangent step: δx at the fraction theta of it, given δy' after it. Sizes nx.
  /// @throws InvalidArgument but for collocation
  virtual void interpolate(const TwoWords& after, double theta, std::span<double> v) const;
  /// After advance(): δY_i, or ℓ_i. Size s · nx.
  /// @throws InvalidArgument for Störmer-Verlet with quaternions, discrete gradients and splittings
  virtual void stages(std::span<double> to) const;
  /// Drops what the last step predicts of the next, which is not its neighbour.
  virtual void forget() {}
  /// After an adjoint step: gradient += Σ h b_i ∂(ℓ_iᵀ f(Y_i))/∂θ. Size of parameters().
  virtual void add_gradient(TwoWords& gradient) = 0;
  /// After an adjoint step, for a field that does not depend on the time: h ∂J/∂h of that step,
  /// Σ h b_i ℓ_iᵀ f(Y_i), without the running cost.
  virtual double by_size() const = 0;
  /// Names of the parameters (phs::Linearised), as far as the method has derivatives by them.
  virtual const std::vector<std::string>& parameters() const = 0;
  /// Sweeps of the iteration and steps so far.
  virtual const Cost& cost() const = 0;
};

/// Of a step of the collocation method with that table. The model must outlive the result.
/// @throws InvalidArgument as phs::linearise()
std::unique_ptr<StepVariation> make_step_variation(const phs::Model& model,
                                                   const CollocationTable<double>& table,
                                                   StepVariation::Side side);
/// Of the pieces of a method.
/// @throws InvalidArgument as phs::linearise()
std::unique_ptr<StepVariation> make_step_variation(const phs::Model& model,
                                                   const StepPieces& pieces,
                                                   StepVariation::Side side);
/// The names of the parameters that a run of a method has derivatives by.
/// @throws InvalidArgument as gradient_of_run()
std::vector<std::string> parameters_of_run(const std::string& method, const phs::Model& model,
                                           double h);

}  // namespace porthos::integrators
