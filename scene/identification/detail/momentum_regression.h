#pragma once
#include <vector>

#include "scene/identification/log.h"
#include "scene/sensitivity/unknowns.h"

namespace porthos::scene {

/// Inertial numbers of bodies by least squares of their momenta, which need no accelerations: with
/// the places q and rates v of a log,
///
///   p(q, v)(t) - ∫ p'(q, v) dt = constant,
///
/// linear in the masses, first moments and inertias about the origins of the bodies, as inverse
/// dynamics is (Atkeson, An, Hollerbach 1986, Int. J. Robot. Res. 5:3). It is solved in the z of
/// the unknowns, so whole bodies stay physical. Places that the log lacks are integrated from the
/// start of the scene. Unknowns that are no numbers of bodies stay where they are.
/// @return z; empty if no body is asked for, the log lacks rates, or the places cannot be known
std::vector<double> bodies_by_momenta(const Scene& scene, const Assembly& assembly,
                                      const Unknowns& unknowns, const Log& log);

}  // namespace porthos::scene
