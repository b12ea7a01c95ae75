#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// porthos sensitivity. @throws InvalidArgument for bad input
int sensitivity_command(const Arguments& arguments);

}  // namespace porthos::apps
