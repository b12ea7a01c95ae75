#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// A film or a picture of the playback of a results folder. The arguments and errors are those of
/// the commands in apps/commands.h.
int film_command(const Arguments& arguments);

}  // namespace porthos::apps
