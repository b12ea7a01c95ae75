#pragma once
#include <string>

#include "apps/commands.h"

namespace porthos::apps {

/// Writes out/report.html of what is in `out`. A page that cannot be made is said on stderr and
/// costs no run its verdict.
/// @return whether it was written; false without a word where there is no template
bool make_report(const std::string& out);

/// porthos report DIR [--out FILE]
int report_command(const Arguments& arguments);

}  // namespace porthos::apps
