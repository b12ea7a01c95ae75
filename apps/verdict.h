#pragma once
#include <string>

#include "scene/run/run_report.h"

namespace porthos::apps {

/// The text of `porthos run`: checks, energy, cost, place of the results, verdict. has_page:
/// report.html is among the results.
std::string verdict_text(const scene::RunReport& report, const std::string& out, bool has_page);

/// "pass", "FAIL" or "not judged".
const char* verdict_word(scene::Verdict v);

}  // namespace porthos::apps
