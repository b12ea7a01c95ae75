#pragma once
#include <array>
#include <span>

#include "mechanics/builder.h"

namespace porthos::mechanics {

/// The inertia of a body as ten free numbers: every choice of them is a physical body, one with a
/// positive mass distribution, and each such body has its own ten. With Σ = ½ tr(I) 1 - I about
/// the centre of mass c, and Σ/m = L Lᵀ with an upper triangular L,
///
///   (½ log m, log L11, log L22, log L33, L12, L23, L13, c_x, c_y, c_z)
///
/// [1, log m, m] in the body's frame. Source: Rucker, Wensing 2022, IEEE Robot. Autom. Lett. 7:2,
/// eq. 12 to 18; their pseudo-inertia, factored, has these blocks.
using LogCholesky = std::array<double, 10>;

/// @throws InvalidArgument for a body that is none: its mass or a semi-axis of Σ is not positive
LogCholesky log_cholesky(const MassProperties& body);
/// The body of ten numbers, with its inertia along the body's axes.
MassProperties from_log_cholesky(const LogCholesky& numbers);

}  // namespace porthos::mechanics
