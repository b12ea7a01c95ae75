#pragma once
#include <vector>

#include "phs/functions/function.h"

namespace porthos::phs {

/// A signal in time of pieces of one length, from time 0: in each a polynomial through given
/// values; before and after them 0. Steps must end where pieces do.
/// @param period  length of a piece, > 0 [s]
/// @param nodes   where its values are, ascending fractions of the period; one: the value is held
/// @param values  those of the first piece, then those of the second ...
/// @throws InvalidArgument for a period that is not positive, a number that is not finite, or
///   values that do not fill whole pieces
FunctionPtr pieces(double period, const std::vector<double>& nodes, std::vector<double> values);

}  // namespace porthos::phs
