#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// porthos judge FILE --model M [--map FILE]
int judge_command(const Arguments& arguments);

}  // namespace porthos::apps
