#pragma once
#include <memory>

#include "contact/contact.h"
#include "integrators/core/integrator.h"

namespace porthos::contact {

/// The method "moreau" for a model with rigid contacts and stops. Its steps have one size, whatever
/// touches in them, so the number of impacts does not change the number of steps. Order 1.
///
///   δ = h (J - R)(m) ∇̄H(x, x + δ) + (0, G(m)ᵀP),  m = x + δ/2
///
/// with the mean value discrete gradient ∇̄H and the impulses P of the contacts whose gap is, or
/// without them would be, closed at the end of the step. P obeys Moreau's impact law and Coulomb's,
/// with exact cones, in the mean velocities u = G ∂̄H/∂p (Cones). H(x + δ) - H(x) is then the work
/// of the other parts plus P·u to rounding, for any H, and P·u <= 0. That is the θ-method with
/// θ = 1/2, the least of those in [1/2, 1/(1 + e)] and the one that books an isolated impact
/// exactly.
///
/// The works are the powers "<name>.impact" and "<name>.friction"; "<name>.impacts" counts contacts
/// that begin. Gaps are kept as velocities: one that closes at the speed v stays open or overlaps
/// by up to h v/2. Cost of a step beyond the model's: a sweep over the contacts takes O(c) and as
/// many are made as the residual needs: 1e-11, or Options::iteration_tolerance where that is more.
/// @param whole  a model whose state begins with that of the mechanism in `contacts`; both must
///   outlive the method
/// @throws InvalidArgument for a soft contact or stop whose force begins at the touch, for dry
///   friction, and as integrators::make_integrator() for h
/// Sources: Moreau 1988; Jean 1999, Comput. Methods Appl. Mech. Eng. 177:235; Acary,
/// arXiv:1410.2499; the discrete gradient: Harten, Lax, van Leer 1983.
std::unique_ptr<integrators::Integrator> with_time_stepping(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const integrators::Options& options = {});

}  // namespace porthos::contact
