#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// Redraws the plots of a run or an ensemble, or draws one of its panels for print. The arguments
/// and errors are those of the commands in apps/commands.h.
int plot_command(const Arguments& arguments);

}  // namespace porthos::apps
