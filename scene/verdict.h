#pragma once
#include "scene/measure.h"
#include "scene/run.h"

namespace porthos::scene {

/// Adds a check for every limit of the scene that means something for this system, and for an
/// outcome that is not ok.
/// A limit on what the system does not keep becomes a note.
void judge(RunReport& report, const Scene& scene, const Meter& meter);

/// Adds the checks of `porthos verify`: up to 100 steps forth and back, and the axioms of the
/// system.
void judge_symmetry(RunReport& report, const Scene& scene, const Assembly& assembly);

}  // namespace porthos::scene
