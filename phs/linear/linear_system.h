#pragma once
#include <complex>
#include <memory>
#include <span>
#include <string>

#include "phs/linear/state_space.h"
#include "phs/linear_algebra/matrix.h"
#include "phs/system/system.h"

/// Linear port-Hamiltonian descriptor systems
///
///   E x' = (J - R) Q x + (G - P) u,    y = (G + P)ᵀ Q x + (S - N) u,    H = ½ xᵀEᵀQ x
///
/// with J, N skew, EᵀQ = QᵀE >= 0 and W = [R P; Pᵀ S] >= 0, so that with z = Qx
///
///   H' = yᵀu - [z; u]ᵀ W [z; u].
///
/// The sign of N: (E x'; -y) = ([J G; -Gᵀ N] - W) (z; u), with one skew and one dissipative matrix
/// (Mehrmann, Morandin 2019).
namespace porthos::phs {

/// J (n × n) and G (n × m) must be given; an empty E or Q is the identity, another empty matrix is
/// zero.
struct LinearMatrices {
  Matrix E = {}, J = {}, R = {}, Q = {}, G = {}, P = {}, S = {}, N = {};
};

/// The energy that can be extracted at the port from a state: sup over u of -∫ yᵀu dt.
struct AvailableStorage {
  double bound;        ///< [J]: an upper bound
  bool exact;          ///< bound is exact; otherwise bound = H(x)
  std::string remark;  ///< how the bound was found
};

/// Immutable. The constructor refuses matrices that are not port-Hamiltonian and names the matrix,
/// the entry and the size of the violation. It tolerates violations up to 1e-12 of the largest
/// entry as rounding.
class LinearSystem {
 public:
  explicit LinearSystem(LinearMatrices matrices, std::string name = "linear system");

  const std::string& name() const { return name_; }
  const LinearMatrices& matrices() const { return m_; }  ///< with defaults filled in
  int states() const { return m_.J.rows; }
  int ports() const { return m_.G.cols; }

  /// H(x) = xᵀ EᵀQ x / 2 [J]. x: size states()
  double hamiltonian(std::span<const double> x) const;
  /// The matrices E, (J - R)Q, G - P, (G + P)ᵀQ, S - N.
  StateSpace state_space() const;
  /// T(s) = (G + P)ᵀQ (sE - (J - R)Q)⁻¹ (G - P) + S - N.
  /// @throws InvalidArgument if that inverse does not exist
  ComplexMatrix transfer(std::complex<double> s) const;
  /// T(0).
  Matrix dc_gain() const;

  /// The smallest eigenvalue of W: a value >= 0 proves by structure that T is positive real.
  double dissipation() const;
  /// Whether T is positive real, judged from T alone without W.
  PositiveReality positive_real() const { return positive_reality(state_space()); }
  /// Exact where the Riccati equation of `smallest_storage` has its solution; otherwise H bounds
  /// it, as H >= 0.
  AvailableStorage available_storage(std::span<const double> x) const;

  /// The system for the integrators: e = EᵀQx; J and R become E⁻¹JE⁻ᵀ and E⁻¹RE⁻ᵀ, G becomes E⁻¹G.
  /// @throws InvalidArgument for a singular E, and for feedthrough (P, S, N), because y = Gᵀe
  /// excludes it
  std::unique_ptr<Model> to_model() const;

 private:
  LinearMatrices m_;
  std::string name_;
};

}  // namespace porthos::phs
