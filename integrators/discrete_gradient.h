#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Discrete gradient methods: x' - x = h (J - R)(m) ∇̄H(x, x') at the midpoint m, with ∇̄H·(x' - x) = H(x') - H(x), so that
/// the power balance holds for any H, any step and any dissipation, to rounding.
///   gonzalez  ∇̄H = ∇H(m) + α δ,  α = (H(x') - H(x) - ∇H(m)·δ) / |δ|²,  δ = x' - x   (Gonzalez 1996, order 2)
///   itoh_abe  ∇̄H_i = the difference quotient of H along coordinate i, the others moved one after another
///             (Itoh, Abe 1988, order 1, O(n) evaluations of H a sweep)
/// Where J and R depend on x, or the system is driven in time, those are taken at the midpoint.
std::vector<Entry> discrete_gradient_entries();

}  // namespace porthos::integrators
