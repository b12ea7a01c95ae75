#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/read/controllers/controller_type.h"

namespace porthos::scene {

/// Adds the condition "sampled" of energy_shaping/held_loop.h to the certificate of a law, at rest;
/// nothing of a continuous one. Beside elements and actuators, which the design does not know, a
/// loop that fails is reported and not refused.
/// @param laws  without limits
/// @param q     of the mechanism, nq numbers
/// @return a remark on a failure that is not refused; else empty
/// @throws InvalidArgument where the condition fails: it names a rate that would do
std::string certify_held(energy_shaping::Certificate& certificate, const Controller& c,
                         const ControllerPlant& plant,
                         const std::vector<energy_shaping::PortLaw>& laws,
                         std::span<const double> q);

}  // namespace porthos::scene
