#pragma once
#include <memory>
#include <vector>

#include "energy_shaping/laws/tracking.h"
#include "energy_shaping/loop/port_law.h"
#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// Computed torque (inverse dynamics; Luh, Walker, Paul 1980) for arms of joints of one degree of
/// freedom:
///   τ = M(q) (q_d'' - Kd e' - Kp e) + C(q, q') q' + D q' + ∂V/∂q,   e = q - q_d
/// so that e'' + Kd e' + Kp e = 0. Gains are kp = ω² [1/s²] and kd = 2 ζ ω [1/s]. Unlike PdPlus it
/// cancels the plant's own dynamics: it is no passive law, and it needs the exact model.
/// @return the law of each joint's port. Cost of an evaluation: an ABA and an RNEA
/// @throws InvalidArgument as PdPlus
std::vector<PortLaw> computed_torque(std::shared_ptr<const mechanics::MechanicalModel> plant,
                                     std::shared_ptr<const Trajectory> trajectory,
                                     std::vector<double> kp, std::vector<double> kd);

}  // namespace porthos::energy_shaping
