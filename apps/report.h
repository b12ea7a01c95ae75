#pragma once
#include <string>

#include "apps/commands.h"

namespace porthos::apps {

/// Writes out/report.html from the results in `out`. If the page cannot be made, a message goes to
/// stderr, and the verdict of the run does not change.
/// @return whether it was written; false without a message if there is no template
bool make_report(const std::string& out);

/// porthos report DIR [--out FILE]
int report_command(const Arguments& arguments);

}  // namespace porthos::apps
