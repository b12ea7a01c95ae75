#pragma once
#include <filesystem>
#include <string>

#include "scene/assemble/assembly.h"
#include "scene/run/checkpoint.h"

/// method = "auto": a method and a step for an energy error, found by short pilot runs.
namespace porthos::scene {

/// The scene with method, step and a record distance put in, and why in `choice`; a scene that
/// states its method as it is.
///
/// Pilots: every symplectic method of order 4 or more that fits; of an energy-exact one the energy
/// says nothing about the step. Each looks for the largest step whose energy error, carried on to
/// the whole duration by the growth it shows, stays below the target. The one that needs the least
/// CPU time is then tried over a longer time, and its step shortened if need be. All of it takes
/// about two seconds.
/// @throws InvalidArgument if the system has damping, or no method is expected to reach the target;
///   says what is in reach
Scene with_method_chosen(const Scene& scene, const Assembly& assembly);

/// The same with the choice of a run that is to be continued.
Scene with_method_of(const Checkpoint& checkpoint, const Scene& scene);

/// The same where many processes run cases of one scene into a folder, perhaps on different
/// machines: the choice is made once, kept in folder/parts/choice, and every process goes by it.
/// @throws InvalidArgument as with_method_chosen(); for a choice that was made for another scene
Scene with_method_kept(const Scene& scene, const std::filesystem::path& folder);

}  // namespace porthos::scene
