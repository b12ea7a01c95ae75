#pragma once
#include <string>

#include "scene/ensemble/ensemble.h"

namespace porthos::apps {

/// The text of `porthos ensemble`: how many cases passed, the distribution of the errors, the
/// failures, and the place of the results. page: report.html is among them.
std::string ensemble_text(const scene::Ensemble& ensemble, const scene::EnsembleReport& report,
                          const std::string& out, bool page);

}  // namespace porthos::apps
