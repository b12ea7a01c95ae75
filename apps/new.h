#pragma once
#include "apps/commands.h"

namespace porthos::apps {

/// porthos new URDF [--out scene.toml]: a commented scene that runs as it is.
int new_command(const Arguments& arguments);

/// porthos schema [--markdown]
int schema_command(const Arguments& arguments);

}  // namespace porthos::apps
