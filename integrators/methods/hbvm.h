#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Hamiltonian boundary value methods HBVM(16, r), order 2r: the slope of the step's polynomial is
/// the best approximation of f along it by polynomials of degree r - 1, its integrals taken at 16
/// Gauss nodes. H is kept as exactly as those integrate its power, O(h³²): to rounding at steps
/// that resolve the motion, far beyond what a trajectory of order 2r gives. Symmetric; neither
/// symplectic nor, beyond linear ones, a keeper of invariants. With J and R constant H(x') - H(x) =
/// -h Σ ē_jᵀ R ē_j, ē_j the Legendre coefficients of ∇H along the step: never a gain. The catalogue
/// has r = 2, 3, 4; r = 1 is mean_value of discrete_gradient.h where that needs one panel. Sources:
/// Brugnano, Iavernaro, Trigiante 2010; Hairer 2010 (J. Numer. Anal. Ind. Appl. Math. 5:73) for k →
/// ∞.
std::vector<Entry> hbvm_entries();

}  // namespace porthos::integrators
