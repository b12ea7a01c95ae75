#pragma once
#include <Eigen/LU>

#include "integrators/tables/collocation_table.h"
#include "planning/detail/cost.h"

namespace porthos::planning::detail {

/// One interval of a plan: a step of Gauss's method from x with inputs w,
///
///   L_i = h b_i f(Y_i, u_i),   Y_i = x + Σ μ_ij L_j,   x' = x + Σ L_i,
///
/// with its cost Σ h b_i l(Y_i, u_i). All derivatives are those of these formulas, at stages that
/// are solved to rounding. With M = 1 - h b Df μ:
///
///   first    M δL = h b (∂f/∂x δx + ∂f/∂u δu)
///   second   Σ h b_i δ(Y_i, u_i)ᵀ ∇²(η_iᵀ f + l) δ(Y_i, u_i),   Mᵀ η = λ' + Σ μ_ij h b_i ∂l_i
class GaussInterval {
 public:
  GaussInterval(const Problem& problem, const integrators::CollocationTable<double>& table,
                int number);

  /// Solves the stages from those of the last call. @return false: no solution was found
  bool solve(const double* x, const double* w);
  /// After solve(): the state at the end and the cost.
  const Vector& end() const { return end_; }
  double cost() const { return cost_; }
  /// The polynomial of the step at its fraction theta.
  Vector value(double theta) const;

  /// After solve(): A = ∂x'/∂x, B = ∂x'/∂w and the gradient of the cost along (x, w).
  void differentiate();
  /// After solve(): the numbers with limits at the stages, stage after stage: the x'_k of
  /// Limits::rate, then those of Limits::path; and after differentiate() their derivatives along
  /// (x, w), a row each.
  const Vector& path() const { return path_; }
  const Matrix& path_rows() const { return path_rows_; }
  const Matrix& A() const { return A_; }
  const Matrix& B() const { return B_; }
  const Vector& gradient() const { return gradient_; }

  /// After differentiate(): the Hessian along (x, w) of cost + λᵀx' + weightsᵀ path, or without
  /// the curvature of f.
  /// @param weights  size of path(); null: 0
  void hessian(const Vector& lambda, bool exact, Matrix& H, const double* weights = nullptr);

  /// After differentiate(): the derivative of the same by the length h, Σ b_i (η_iᵀ f_i + l_i), if
  /// f does not depend on t.
  double by_length(const Vector& lambda, const double* weights) const;

 private:
  bool iterate(bool afresh);
  void spread(const double* w);
  void place(const Vector& L);
  void spread_moves(long i, Matrix& Z) const;
  void factorise();
  std::span<const double> state_at(long i) const { return {Y_.data() + i * nx_, size_t(nx_)}; }
  void add_path_curvature(const double* weights, std::vector<Matrix>& own);
  Vector adjoint_stages(const Vector& lambda, const double* weights) const;

  const Problem& p_;
  const integrators::CollocationTable<double>& table_;
  long s_, nx_, nu_, nw_;
  CostAtPoint point_;
  std::vector<long> limited_;  ///< the k of Limits::rate
  long per_stage_ = 0;         ///< numbers with limits at a stage
  std::vector<double> hb_, t_, u_, f_, J_, H_;
  Vector x_, w_, L_, Y_, end_, gradient_, residual_, path_;
  Matrix sensitivity_;  ///< ∂L/∂(x, w)
  Eigen::PartialPivLU<Matrix> lu_;
  Matrix A_, B_, dl_, path_rows_;
  Matrix path_slopes_;  ///< by (Y_i, u_i)
  double cost_ = 0;
  bool have_factor_ = false, have_sensitivity_ = false;
};

}  // namespace porthos::planning::detail
