#pragma once
#include <string>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// The text of `porthos info`: states, ports, invariants, the plan (active and absent effects) and
/// the measured cost of one evaluation.
/// @throws InvalidArgument for what a run would refuse before its first step
std::string info_text(const Scene& scene, const Assembly& assembly);
/// The same as one JSON object (`porthos info --json`, docs/commands.md).
/// @throws InvalidArgument as info_text()
std::string info_json(const Scene& scene, const Assembly& assembly);

/// The text of `porthos --version`: version, git hash, compiler, flags, SIMD.
std::string version_text();

}  // namespace porthos::scene
