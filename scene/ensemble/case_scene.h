#pragma once
#include <cstdint>
#include <filesystem>

#include "scene/ensemble/ensemble.h"

/// A case of an ensemble as a scene by itself: run, recorded and looked at as any other.
namespace porthos::scene {

/// The scene of case `index`: its text has the numbers of the case, the method, step and duration
/// of the ensemble, and [run] case, by which its sensors have the noise of the case; [ensemble] is
/// gone. It takes the steps of the case, with the same bits.
/// @throws InvalidArgument for an index that no case has; "case 7: ..." for a case whose numbers
///   the reader refuses
Scene scene_of_case(const Ensemble& ensemble, std::int64_t index);

/// The same of a scene with an [ensemble]; method = "auto" chooses anew.
/// @throws InvalidArgument also as Ensemble and with_method_chosen()
Scene scene_of_case(Scene scene, std::int64_t index);

/// The same from the results of a finished ensemble, which hold the texts and the numbers.
/// @param results  the folder of its ensemble.h5
/// @throws InvalidArgument also for a folder without one, and for a scene with a law of the user's
///   own, which results do not hold
Scene scene_of_case(const std::filesystem::path& results, std::int64_t index);

/// Whether a folder holds the results of a finished ensemble.
bool has_ensemble(const std::filesystem::path& folder);

}  // namespace porthos::scene
