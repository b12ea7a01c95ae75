#pragma once
#include <string>

#include "energy_shaping/matching/numerical_matching.h"

namespace porthos::energy_shaping {

/// @throws InvalidArgument for a rest that is no equilibrium along the unactuated coordinate, or
///   near which nothing pulls it: no law moves it to its rest then. what: the begin of the sentence
void require_matching_rest(const phs::Model& plant, const NumericalMatching& options,
                           const std::string& what);

}  // namespace porthos::energy_shaping
