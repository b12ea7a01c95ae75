#pragma once
#include <vector>

#include "phs/functions/function.h"

namespace porthos::phs {

/// A position told for every time, for a driven joint [rad | m].
struct Motion {
  FunctionPtr position;
  FunctionPtr rate;              ///< its derivative
  std::vector<double> instants;  ///< ascending times at which a higher derivative jumps [s]
};

/// One move from rest to rest.
struct Move {
  double at, duration;  ///< it begins at `at` and takes `duration` > 0 [s]
  double to;            ///< position at its end [rad | m]
};

/// x = start + rate t. @throws InvalidArgument for a number that is not finite; `what` names the
/// motion in the text, here and below
Motion steady_motion(double start, double rate, const char* what = "motion");
/// x = middle + amplitude sin(2π frequency t + phase). @param frequency  > 0 [Hz]; phase [rad]
Motion swinging_motion(double middle, double amplitude, double frequency, double phase,
                       const char* what = "motion");
/// Moves one after another with rests between, each along the polynomial of degree 5 with the least
/// jerk. Source: Flash, Hogan 1985, J. Neuroscience 5:1688.
/// @param moves  not empty; none begins before the last has ended
Motion moves_from(double start, const std::vector<Move>& moves, const char* what = "motion");

}  // namespace porthos::phs
