#pragma once
#include <string>
#include <vector>

#include "energy_shaping/laws/potential_loop.h"

/// What to do where a condition of potential shaping fails.
namespace porthos::energy_shaping {

/// Where the Hessian of V_d in q has a negative eigenvalue. K: nq × nq
std::string help_of_saddle(const mechanics::Mechanism& m, const PotentialLoop::Parts& p,
                           const std::vector<double>& K);
/// Whether what nothing drives, nor is to have a spring, hangs at the rest, where constant forces
/// of the others leave it.
bool hangs(const mechanics::MechanicalModel& model, const PotentialLoop::Parts& p,
           const std::vector<double>& x, double tolerance);
/// At a joint that nothing drives, where a force is wanted. hanging: as of hangs()
std::string help_of_unheld(const PotentialShaping& s, const PotentialLoop::Parts& p,
                           const mechanics::Mechanism& m, const std::string& joint, bool hanging);

}  // namespace porthos::energy_shaping
