#pragma once
#include <vector>

#include "energy_shaping/certify/certify.h"

namespace porthos::energy_shaping {

/// Reports the largest input on H_d = c, found by climbing from states on straight ways from the
/// rest point, and from where the limits act. @return the H_d from which they do, infinite where no
/// state was found; of a basin that holds a state
double inputs_on_basin(const ClosedLoop& loop, const Region& region, const Basin& basin,
                       const std::vector<double>& limits, Certificate& certificate);

}  // namespace porthos::energy_shaping
