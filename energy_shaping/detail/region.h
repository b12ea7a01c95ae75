#pragma once
#include <random>
#include <span>
#include <vector>

#include "energy_shaping/certify.h"

namespace porthos::energy_shaping {

/// @throws InvalidArgument for another number of coordinates, a region without the rest point
///   inside, and one with an end for which the law is not meant (ClosedLoop::hindrance)
void check_region_of(const ClosedLoop& loop, const Region& r);
std::vector<double> random_coordinates(const Region& r, std::mt19937_64& generator);
/// Whether V_d stays below the level from the rest point straight to q: q is in its component then.
bool straight_way_below(const ClosedLoop& loop, std::span<const double> q, double level);
bool has_quaternions(const ClosedLoop& loop);

}  // namespace porthos::energy_shaping
