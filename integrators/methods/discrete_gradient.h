#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Discrete gradient methods: with δ = x1 - x0 and m = x0 + δ/2,
///   δ = h (J(m) - R(m)) ∇̄H(x0, x1),   ∇̄H · δ = H(x1) - H(x0),
/// so that H(x1) - H(x0) = -h ∇̄Hᵀ R(m) ∇̄H: without R, H is conserved for any H, J and step that
/// converges.
///   gonzalez    ∇̄H = ∇H(m) + (H(x1) - H(x0) - ∇H(m)·δ) v / (v·δ), order 2. The textbook has
///               v = δ. Here v is δ minus its part along J∇C(m) for every linear and quadratic
///               invariant C that the system declares. That conserves them as well (an
///               energy-momentum method); without declared invariants it is the same method
///   mean_value  ∇̄H = ∫₀¹ ∇H(x0 + τδ) dτ, order 2 (average vector field)
///   itoh_abe    ∇̄H_i = the slope of H from (x1_1 … x1_{i-1}, x0_i …) to
///               (x1_1 … x1_i, x0_{i+1} …), order 1
///   itoh_abe2   the mean of itoh_abe's and its adjoint's (the coordinates in reverse order),
///               order 2
/// All differences of H are integrals of ∇H along segments (MeanGradient), so nothing cancels as δ
/// → 0 and no slope is 0/0. If H is not smooth the integrals may fail. gonzalez then detects the
/// contradiction with the difference of H itself and uses that difference. The others conserve H as
/// well as the panels integrate it. Sources outside (J - R)∇H enter by their value at the middle.
///
/// Methods other than gonzalez conserve at most linear invariants: |ξ| and ξ·π of quaternion blocks
/// and angular momentum drift. Sources: Gonzalez 1996 (J. Nonlinear Sci. 6:449), symmetries
/// included; Itoh, Abe 1988 (J. Comput. Phys. 76:85); McLachlan, Quispel, Robidoux 1999 (Phil.
/// Trans. R. Soc. A 357:1021); Celledoni, Hoiseth 2017 (arXiv:1706.08621) for R and ports.
enum class DiscreteGradientRule { gonzalez, mean_value, itoh_abe, itoh_abe2 };

/// A method of these: its steps as x0 + δ/2 in the place of a stage, and δ in that of multipliers
/// (methods/staged_steps.h).
class DiscreteGradientSteps {
 public:
  virtual ~DiscreteGradientSteps() = default;
  virtual DiscreteGradientRule rule() const = 0;
};

std::vector<Entry> discrete_gradient_entries();

}  // namespace porthos::integrators
