#pragma once
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <vector>

namespace porthos::planning::detail {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// The quadratic programme of one Newton step, with a block for each interval:
///
///   min  Σ ½ zᵀH z + gᵀz  +  ½ x_NᵀH_N x_N + g_Nᵀx_N,   z = (x_k, w_k)
///   x_{k+1} = A x_k + B w_k + d,   x_0 = 0,   C x_N + c = 0
struct QuadraticProgramme {
  struct Stage {
    Matrix A, B, H;
    Vector d, g;
  };
  std::vector<Stage> stages;
  Matrix last_H, C;
  Vector last_g, c;
};

/// Solves it in one sweep back and one forth, O(N (nx + nw)³). The cost to go is ½xᵀP x + (p +
/// Γν)ᵀx with the multipliers ν of the goals kept open: Γ is carried back with P, and W ν = g at
/// the start gives them (Bryson, Ho 1975, section 5.3). Goals also add ½ρ|Cx + c|², which changes
/// no solution, and makes the sweep's matrices positive where the cost is convex only among motions
/// that reach the goals.
class RiccatiQp {
 public:
  /// Where the sweep found the problem not to be convex: nothing is solved.
  enum class Result { ok, not_convex };
  /// @param regularisation  added to the diagonal of each input's block;  rho: as above;
  ///   any: take a stationary point that is no minimum too
  Result solve(const QuadraticProgramme& qp, double regularisation, double rho, bool any = false);

  std::vector<Vector> x;       ///< N + 1 moves of the states
  std::vector<Vector> w;       ///< N moves of the inputs
  std::vector<Vector> lambda;  ///< N + 1: λ_k of x_k = A x + B w + d; λ_0 = the slope by x_0
  Vector nu;                   ///< of the goals
  /// The law w = w_k + K (x - x_k) along which the moves were made.
  const Matrix& feedback(size_t k) const { return gains_[k].K; }
  /// Goals that no input reaches, to first order.
  int unreached = 0;

 private:
  struct Gains {
    Matrix K, Knu;
    Vector k;
  };
  bool back(const QuadraticProgramme& qp, double regularisation, bool any);
  void settle_goals();
  void forth(const QuadraticProgramme& qp);

  std::vector<Gains> gains_;
  std::vector<Matrix> P_, Gamma_;
  std::vector<Vector> p_;
  Matrix PA_, PB_, Q_, S_, R_, Gw_;
  Vector q_, r_, pd_;
  Matrix W_;
  Vector e_;
  Eigen::LLT<Matrix> llt_;
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace porthos::planning::detail
