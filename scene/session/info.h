#pragma once
#include <string>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// The text of `porthos info`: states, ports, invariants, the plan (active and absent effects) and
/// the measured cost of one evaluation.
std::string info_text(const Scene& scene, const Assembly& assembly);

/// The text of `porthos --version`: version, git hash, compiler, flags, SIMD.
std::string version_text();

}  // namespace porthos::scene
