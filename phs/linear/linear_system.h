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
/// The sign of N: (E x'; -y) = ([J G; -Gᵀ N] - W) (z; u), one skew matrix and one that dissipates
/// (Mehrmann, Morandin 2019).
namespace porthos::phs {

/// J (n × n) and G (n × m) must be given; an empty E or Q is the identity, another empty matrix is
/// zero.
struct LinearMatrices {
  Matrix E = {}, J = {}, R = {}, Q = {}, G = {}, P = {}, S = {}, N = {};
};

/// What can be drawn from a state at the port: sup over u of -∫ yᵀu dt.
struct AvailableStorage {
  double bound;        ///< [J]: never less than that
  bool exact;          ///< it is that; otherwise bound = H(x)
  std::string remark;  ///< how the bound was found
};

/// Immutable. The constructor refuses what is not port-Hamiltonian and names matrix, entry and size
/// of the violation; violations up to 1e-12 of the largest entry pass as rounding.
class LinearSystem {
 public:
  explicit LinearSystem(LinearMatrices matrices, std::string name = "linear system");

  const std::string& name() const { return name_; }
  const LinearMatrices& matrices() const { return m_; }  ///< all of them filled in
  int states() const { return m_.J.rows; }
  int ports() const { return m_.G.cols; }

  double hamiltonian(std::span<const double> x) const;
  /// E, (J - R)Q, G - P, (G + P)ᵀQ, S - N.
  StateSpace state_space() const;
  /// T(s) = (G + P)ᵀQ (sE - (J - R)Q)⁻¹ (G - P) + S - N. Refuses where that inverse does not exist.
  ComplexMatrix transfer(std::complex<double> s) const;
  /// T(0).
  Matrix dc_gain() const;

  /// The smallest eigenvalue of W: >= 0 proves that T is positive real, by structure.
  double dissipation() const;
  /// The same asked of T alone, which knows nothing of W.
  PositiveReality positive_real() const { return positive_reality(state_space()); }
  /// Exact where the Riccati equation of `smallest_storage` has its solution; otherwise H bounds
  /// it, as H >= 0.
  AvailableStorage available_storage(std::span<const double> x) const;

  /// The system for the integrators: e = EᵀQx, J and R become E⁻¹JE⁻ᵀ and E⁻¹RE⁻ᵀ, G becomes E⁻¹G.
  /// Refuses a singular
  /// E and feedthrough (P, S, N), which the contract y = Gᵀe has no place for.
  std::unique_ptr<Model> to_model() const;

 private:
  LinearMatrices m_;
  std::string name_;
};

}  // namespace porthos::phs
