#pragma once
#include <string>

#include "scene/read/scene.h"

/// Code shared by building a model and setting its start. Private to scene/assemble.
namespace porthos::scene {

[[noreturn]] void refuse_start(const std::string& name, const JointStart& start,
                               const std::string& why);

/// A locked joint, or a coordinate of one.
bool is_locked(const Scene& scene, const std::string& name);

}  // namespace porthos::scene
