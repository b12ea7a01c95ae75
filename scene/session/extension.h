#pragma once
#include <string>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// Sets a scene's end to a later time, for the finished run in `folder` that reopen() and then
/// run() with `resume` continue. Records stay as far apart as they are there.
/// @throws InvalidArgument if the folder has no run that can be continued, or it ends later already
void extend_to(Scene& scene, const std::string& folder, double end);

/// Makes the checkpoint of a finished run that is continued: its last state, and its records from
/// run.h5. Where an extension was interrupted, its own checkpoint stays.
/// @throws InvalidArgument if a run in `folder` is of another scene, or its records have changed
void reopen(const std::string& folder, const Scene& scene, const Assembly& assembly);

}  // namespace porthos::scene
