#pragma once
#include <random>
#include <vector>

#include "energy_shaping/certify.h"

namespace porthos::energy_shaping {

std::vector<double> random_coordinates(const Region& r, std::mt19937_64& generator);
bool has_quaternions(const ClosedLoop& loop);

}  // namespace porthos::energy_shaping
