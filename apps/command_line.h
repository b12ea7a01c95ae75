#pragma once
#include "apps/commands.h"

namespace CLI {
class App;
}

namespace porthos::apps {

/// Adds all subcommands with their options, which parsing writes into the arguments.
void add_commands(CLI::App& app, Arguments& arguments);

}  // namespace porthos::apps
