#pragma once
#include <string>

#include "scene/ensemble/ensemble.h"

namespace porthos::scene {

/// The distribution of the errors of the cases, as an SVG document: a histogram per invariant on a
/// logarithmic axis, with the median, the 95 % quantile and the limit of the verdict.
std::string ensemble_plot(const Ensemble& ensemble, const CaseStore& store,
                          const EnsembleReport& report);

}  // namespace porthos::scene
