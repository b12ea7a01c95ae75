#pragma once
#include <Eigen/Core>

#include "scene/identification/log.h"
#include "scene/sensitivity/unknowns.h"

namespace porthos::scene {

/// Refuses a log that cannot be in s, rad and rad/s: a rate that is some 57 times the slope of its
/// angle, or a 57th, or 1000 times of all of them; times that last a hundred runs of the scene with
/// rows that are many steps apart.
/// @throws InvalidArgument which names the column and the unit it seems to have
void require_units(const Log& log, const Scene& scene);

/// What to ask before a fit: columns that seem to be in degrees beside the run from the scene's
/// values, and a start that is another than the log's, where it is not asked for.
/// @param before  (run - log)/σ of that run, row by row
std::vector<std::string> questions_before(const Log& log, const Eigen::VectorXd& before,
                                          const Unknowns& unknowns);

/// z of the scene, with starts that are asked for as the first row of a log from 0 on has them; of
/// joints whose angle alone is logged the rate by the first rows.
std::vector<double> with_start_of(const Log& log, const Unknowns& unknowns);

}  // namespace porthos::scene
