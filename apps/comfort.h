#pragma once
#include <string>

#include "apps/commands.h"

namespace CLI {
class App;
}

namespace porthos::apps {

/// porthos new URDF [--out scene.toml]: a commented scene that runs as it is.
int new_command(const Arguments& arguments);

/// porthos schema [--markdown]
int schema_command(const Arguments& arguments);

/// porthos completion SHELL: a script for bash, zsh or fish, made from the commands and options of
/// `app` itself.
int completion_command(const CLI::App& app, const Arguments& arguments);

}  // namespace porthos::apps
