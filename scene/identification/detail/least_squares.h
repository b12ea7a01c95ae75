#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace porthos::scene {

/// Residuals at z and, if the pointer is not null, their Jacobian. @return false where there are
/// none
using Residuals =
    std::function<bool(const std::vector<double>& z, Eigen::VectorXd& r, Eigen::MatrixXd* slopes)>;

/// A point of least squares, min ½ |r(z)|².
struct Fit {
  bool converged = false;
  std::vector<double> z;
  Eigen::VectorXd r;
  Eigen::MatrixXd slopes;           ///< ∂r/∂z at z
  Eigen::VectorXd singular;         ///< of the Jacobian at z, largest first; size k
  Eigen::MatrixXd directions;       ///< columns: the right singular vectors, k · k
  double noise = 1;                 ///< standard deviation of r: 1, or |r|/√(n - k) if not known
  bool at_edge = false;             ///< no step follows, because there are no residuals beyond
  int iterations = 0, refused = 0;  ///< refused: steps where there were no residuals
  std::vector<std::vector<double>> iterates;  ///< every z that had residuals, the start first

  /// How far a change of r moves z along direction i, in 1σ of it.
  double shift(const Eigen::VectorXd& change, Eigen::Index i) const;
  /// 1σ along direction i; infinite where the Jacobian is singular to its own rounding.
  double deviation(Eigen::Index i) const;
  /// Whether the data tell a place along direction i within what z calls a whole change.
  bool tells(Eigen::Index i) const { return deviation(i) <= 1; }
};

/// How a fit ends.
struct FitOptions {
  bool noise_known = true;  ///< r has the standard deviation 1
  double share = 0;         ///< also done after a step that lessens |r|² by less than this share
  int most = 50;            ///< iterations
  std::function<bool(const Fit&)> go_on;  ///< called after each iteration; false: give up
};

/// Levenberg and Marquardt: steps -(JᵀJ + λ)⁻¹Jᵀr by the singular values of J, λ by the gain ratio
/// (Nielsen 1999, IMM-REP-1999-05). λ is no less than (noise/10)², as if each z were known to ten
/// whole changes: what the data do not tell stays where it is. λ grows while a step changes some z
/// by more than a half, or twice the last change where the model was right, where there are no
/// residuals, and where |r| does not lessen. Half of the
/// geodesic acceleration is added (Transtrum, Sethna 2012).
///
/// It has converged where a whole Gauss-Newton step along all directions that the data tell would
/// lessen |r|² by less than 1e-6 of the noise's variance, a thousandth of 1σ; or where steps are at
/// rounding.
/// @param z  of entries of order one
/// @return without iterates if there are no residuals at z
Fit least_squares(const Residuals& residuals, std::vector<double> z, const FitOptions& options);

}  // namespace porthos::scene
