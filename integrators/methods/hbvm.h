#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Hamiltonian boundary value methods HBVM(16, r), order 2r. The slope of the step's polynomial is
/// the best approximation of f along it by polynomials of degree r - 1, with integrals taken at 16
/// Gauss nodes. H is conserved as exactly as these integrate its power, O(h³²): to rounding at
/// steps that resolve the motion, far better than a trajectory of order 2r suggests. Symmetric, but
/// not symplectic. Besides H it conserves only linear invariants. With J and R constant, H(x') -
/// H(x) = -h Σ ē_jᵀ R ē_j, ē_j the Legendre coefficients of ∇H along the step: H never increases.
/// The catalogue has r = 2, 3, 4; r = 1 is mean_value of discrete_gradient.h if that needs one
/// panel. Sources: Brugnano, Iavernaro, Trigiante 2010; Hairer 2010 (J. Numer. Anal. Ind. Appl.
/// Math. 5:73) for k → ∞.
std::vector<Entry> hbvm_entries();

}  // namespace porthos::integrators
