#pragma once
#include "phs/functions/smooth_step.h"

/// The valves of a store of energy E that pays for a law and holds between `least` and `most` [J].
namespace porthos::phs {

/// Of the range, at either bound, where the valves move.
inline constexpr double tank_margin = 0.1;

/// The level from which on the store pays a law in full [J].
inline double tank_reserve(double least, double most) {
  return least + tank_margin * (most - least);
}

/// The share of a law that the store pays: 1, and 0 where it is empty.
template <class T>
T tank_share(const T& E, double least, double most) {
  return smooth_step(E, least, tank_reserve(least, most));
}

/// What leaves a store that is full, of what flows in [W].
template <class T>
T tank_overflow(const T& E, double least, double most, const T& inflow) {
  return smooth_step(E, most - tank_margin * (most - least), most) * max(inflow, T(0.0));
}

}  // namespace porthos::phs
