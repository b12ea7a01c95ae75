#pragma once
#include <optional>
#include <string>

#include "scene/run/measure.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Adds a line for every limit of the scene, or of default_limits() if it states none: a check, or
/// the reason why there is none. Adds one for an outcome that is not ok. If all requested checks
/// hold with any step and the energy does not, the energy is judged too.
/// @param method  declaration of the integrator of the run
void judge(RunReport& report, const Scene& scene, const integrators::Declaration& method,
           const Meter& meter);

/// Whether judge_beside() has something to do for a report that judge() has seen.
bool has_more_to_judge(const RunReport& report, const Scene& scene, bool all);

/// Makes the checks that take steps and states of their own: step halving, if the scene has a limit
/// for it or no other check is telling; with `all` (porthos verify) also the axioms of the system
/// and the symmetry in time. Never throws: a check that cannot be made has failed.
void judge_beside(RunReport& report, const Scene& scene, const Assembly& assembly, bool all);

/// The limit of a check by its name, which is the same in every run of a scene; none: of a
/// requirement, see Stop, and of a check that is made in another way.
std::optional<double> limit_of_check(const Scene& scene, const std::string& check);

/// Why a run ended early, and what may help.
std::string ending(const RunReport& report);

/// Limits that a scene need not state. If halving the step changes a trajectory by more than a
/// thousandth of its size, it is not resolved.
inline constexpr double usual_step_halving = 1e-3;
inline constexpr double usual_constraints = 1e-12;
/// Across an event: rounding of the state after it.
inline constexpr double usual_momentum_jump = 1e-14;

/// The least relative energy error that contradicts a method's claim to keep the energy with any
/// step.
inline constexpr double no_exact_energy = 1e-8;
/// Whether the energy error of a run does.
bool contradicts_exact_energy(const RunReport& report);

/// Whether EnergyReport::next_to_nothing moves: the energy says nothing of the motion.
bool next_to_nothing_moves(const EnergyReport& e);

}  // namespace porthos::scene
