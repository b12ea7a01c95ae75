#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace porthos::scene {

/// The derivatives of n functions along one direction, and what they may be wrong by.
struct Differences {
  std::vector<double> slope, error;
};

/// Central differences of f at d = ±step, ±step/2, ±step/4 …, extrapolated to d = 0. Each function
/// takes the entry of its tableau that has the least error: the disagreement with its neighbours
/// plus the rounding of f over its smallest d, without which entries of noise would agree by
/// chance. Cost: 24 calls of f. Source: Ridders 1982, Adv. Eng. Software 4.
/// @param f  the n values at a displacement d, valid until the next call
/// @param rounding  of f, relative to its values
Differences ridders(const std::function<std::span<const double>(double d)>& f, std::size_t n,
                    double step, double rounding = 0x1p-52);

}  // namespace porthos::scene
