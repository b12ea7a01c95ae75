#pragma once
#include <string>

#include "scene/ensemble/ensemble.h"

namespace porthos::apps {

/// What `porthos ensemble` prints: how many cases passed, how the errors are spread, what failed,
/// where the results are.
std::string ensemble_text(const scene::Ensemble& ensemble, const scene::EnsembleReport& report,
                          const std::string& out);

}  // namespace porthos::apps
