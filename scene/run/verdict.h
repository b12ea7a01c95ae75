#pragma once
#include <string>

#include "scene/run/measure.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Adds a line for every limit of the scene, or of default_limits() where it states none: a check,
/// or why there is none. Adds one for an outcome that is not ok. Where all that was asked holds
/// whatever the step and the energy does not, the energy is judged besides.
/// @param method  what the integrator at work declares
void judge(RunReport& report, const Scene& scene, const integrators::Declaration& method,
           const Meter& meter);

/// Whether judge_beside() has something to do for a report that judge() has seen.
bool has_more_to_judge(const RunReport& report, const Scene& scene, bool all);

/// What is checked by steps and states of its own, beside the run: half the step, where the scene
/// has a limit for it or nothing else tells of the motion; with `all` (porthos verify) the axioms
/// of the system and the way forth and back. Never throws: a check that cannot be made has failed.
void judge_beside(RunReport& report, const Scene& scene, const Assembly& assembly, bool all);

/// Why a run ended before its time, and what may help.
std::string ending(const RunReport& report);

}  // namespace porthos::scene
