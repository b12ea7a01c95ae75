#pragma once
#include "scene/session/run.h"

namespace porthos::scene {

/// Runs a scene with events: a phase up to each event and one after the last, every one a run of
/// its own mechanism with results in `out`/phase_1, phase_2 … that stay readable whatever changes.
/// `out`/summary.json is of the whole: the worst errors of all phases, the plastic losses among the
/// losses, the momenta across each event among the checks, and "events" and "phases" in full.
/// Killed at any moment, it continues bit for bit with `resume`.
/// @throws InvalidArgument as run(); for an event that is not at a whole step inside the run, or
///   that cannot be (capture out of reach ...), when the run comes to it: the phases before it are
///   kept
RunReport run_phases(const Scene& scene, const Assembly& assembly, const RunOptions& options);

}  // namespace porthos::scene
