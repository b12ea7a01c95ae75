#pragma once
#include <random>
#include <span>
#include <vector>

#include "energy_shaping/certify/certify.h"

namespace porthos::energy_shaping {

/// As basin(), with the critical_points() of the region.
Basin basin(const ClosedLoop& loop, const Region& region, const std::vector<CriticalPoint>& points,
            int cells = 0);
std::vector<double> random_coordinates(const Region& r, std::mt19937_64& generator);
/// Whether V_d stays below the level from the rest point straight to q: q is in its component then.
bool straight_way_below(const ClosedLoop& loop, std::span<const double> q, double level);
bool has_quaternions(const ClosedLoop& loop);

}  // namespace porthos::energy_shaping
