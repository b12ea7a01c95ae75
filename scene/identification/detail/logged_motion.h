#pragma once
#include <array>
#include <optional>
#include <vector>

#include "scene/identification/log.h"

namespace porthos::scene {

/// Coordinates and joint rates of a mechanism at the times of a log.
struct LoggedMotion {
  std::vector<std::vector<double>> q, v;
  std::vector<double> sigma;  ///< standard deviation of each rate's noise; 1: not known
};

/// Of a log that has all rates. Places that it lacks are integrated from the start of the scene.
/// @param start_known  false: the scene's start does not count, and all places must be in the log
/// @return none if rates are missing, or places and their start
std::optional<LoggedMotion> motion_of(const Assembly& assembly, const Log& log, bool start_known);

/// Weights of values at neighbouring times, at most four: Σ weight[k] · value(first + k).
struct Neighbours {
  size_t first = 0, count = 0;
  std::array<double, 4> weight{};
};
/// Of the polynomial through them at time t, from times[i] to the next.
Neighbours interpolation(const std::vector<double>& times, size_t i, double t);
/// Of its integral over that interval [s].
Neighbours integration(const std::vector<double>& times, size_t i);

}  // namespace porthos::scene
