#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// porthos identify. @throws InvalidArgument for bad input
int identify_command(const Arguments& arguments);

}  // namespace porthos::apps
