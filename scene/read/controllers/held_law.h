#pragma once
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene/read/controllers/controller_type.h"

namespace porthos::scene {

/// Adds the condition "sampled" (loop/held_loop.h) to the certificate of a law, at rest;
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

/// What a law acts on beside the mechanism, in a network with it as its member "mechanism".
struct HeldNetwork {
  std::function<void(phs::Network&)> beside;  ///< adds what acts between the instants too
  std::function<void(phs::Network&)> laws;    ///< adds the laws, as continuous ones
  /// The states of other members at rest.
  std::vector<std::pair<std::string, std::vector<double>>> rest = {};
  bool actuators = false;  ///< those of the scene are among them
};
/// The same of laws on such a network. Where it has no linearisation at its rest, the certificate
/// says that it was not checked.
/// @param q  of the mechanism, nq numbers
std::string certify_held(energy_shaping::Certificate& certificate, const Controller& c,
                         const ControllerPlant& plant, const HeldNetwork& network,
                         std::span<const double> q);

/// The same with the scene's actuators at rest, for laws at their motors.
/// @param q      of the mechanism, nq numbers
/// @param theta  of each actuator, in their order [rad]
HeldNetwork with_actuators(const ControllerPlant& plant, std::span<const double> q,
                           const std::vector<double>& theta,
                           std::function<void(phs::Network&)> laws);

/// Tells in the certificate of a sampled law that its rate was not checked, and why.
void hold_not_checked(energy_shaping::Certificate& certificate, const Controller& c,
                      const std::string& why);

}  // namespace porthos::scene
