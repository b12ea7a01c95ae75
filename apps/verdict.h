#pragma once
#include <string>

#include "scene/run.h"

namespace porthos::apps {

/// What `porthos run` prints: checks, energy, cost, where the results are, verdict.
std::string verdict_text(const scene::RunReport& report, const std::string& out);

/// What `porthos methods` prints.
std::string methods_text();

}  // namespace porthos::apps
