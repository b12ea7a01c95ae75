#pragma once
#include <string>

#include "scene/run/run_report.h"
#include "scene/run/statistics.h"

namespace porthos::scene {

/// What is known of the growth of an error, but for its rate.
/// @param interval  of the records [s]
/// @param scale     to which the reported errors are relative
void set_growth(EnergyReport& e, const ErrorStatistics& s, double interval, double scale = 1);

/// Whether all that is known of a run is its start: it has no errors.
bool only_start(const RunReport& r);
/// Whether the energy of a run overflowed. An error relative to it is about 1 and tells nothing.
bool energy_overflowed(const RunReport& r);

/// How the energy error of a run grew, for people: what follows "the energy error", as in "grows
/// like rounding, √t (growth exponent 0.48)". An exponent speaks of rounding only where the error
/// is a few units of rounding times √steps; a significant drift is always told, with its rate.
std::string growth_words(const RunReport& r);
/// The same of a series of relative errors, one for each step: a drift is told per record.
std::string growth_words(const ErrorStatistics& s);

}  // namespace porthos::scene
