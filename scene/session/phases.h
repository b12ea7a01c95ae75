#pragma once
#include "scene/session/run.h"

namespace porthos::scene {

/// Runs a scene with events: a phase up to each event and one after the last. Each is a run of its
/// own mechanism with results in `out`/phase_1, phase_2 … `out`/summary.json covers the whole: the
/// largest errors of all phases, the plastic losses among the losses, the momenta across each event
/// among the checks, and "events" and "phases" in full. If killed at any moment, it continues bit
/// for bit with `resume`. An event that is impossible when the run reaches it (a capture out of
/// reach ...) ends the run, which then fails.
/// @throws InvalidArgument as run(), and for an event that is not at a whole step inside the run
RunReport run_phases(const Scene& scene, const Assembly& assembly, const RunOptions& options);

/// @throws InvalidArgument for a folder with an unfinished run, of one phase or several
void refuse_unfinished(const std::string& out);

}  // namespace porthos::scene
