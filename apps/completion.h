#pragma once
#include "apps/commands.h"

namespace CLI {
class App;
}

namespace porthos::apps {

/// porthos completion SHELL: a script for bash, zsh or fish, made from the commands and options of
/// `app` itself.
int completion_command(const CLI::App& app, const Arguments& arguments);

}  // namespace porthos::apps
