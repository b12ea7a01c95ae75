#pragma once
#include <filesystem>
#include <string>

#include "scene/assemble/assembly.h"
#include "scene/run/checkpoint.h"

/// method = "auto": a method and a step for an energy error, found by short pilot runs.
namespace porthos::scene {

/// The scene with method, step and a record distance filled in, and the reason in `choice`. A scene
/// that states its method is returned unchanged.
///
/// Pilots are run with every symplectic method of order 4 or more that fits; the energy of an
/// energy-exact method says nothing about the step. For each method the largest step is searched
/// whose energy error, extrapolated to the whole duration by its observed growth, stays below the
/// target. The method that needs the least CPU time is then tried over a longer time, and its step
/// is shortened if necessary. It is also piloted with both step controls, outside an orbit and
/// without loops and sampled controllers: one that takes less than 0.8 of the time is named in
/// `choice`. All of it takes about two to three seconds.
/// @throws InvalidArgument if the system has damping, or no method is expected to reach the target;
///   says what is in reach
Scene with_method_chosen(const Scene& scene, const Assembly& assembly);

/// The same with the choice of a run that is to be resumed.
Scene with_method_of(const Checkpoint& checkpoint, const Scene& scene);

/// The same for many processes that run cases of one scene into a folder, perhaps on different
/// machines: the choice is made once and stored in folder/parts/choice, and every process uses it.
/// @throws InvalidArgument as with_method_chosen(); for a choice that was made for another scene
Scene with_method_kept(const Scene& scene, const std::filesystem::path& folder);

}  // namespace porthos::scene
