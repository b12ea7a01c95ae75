#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace porthos::scene {

struct Scene;
struct Assembly;

/// An angular momentum over a run, at its records [N m s].
struct MomentumRow {
  std::string name;
  double start = 0, end = 0, largest = 0;  ///< largest: of its size
};

/// What the wheels of a scene hold: per wheel the momentum conjugate to its joint, that is its whole angular momentum about
/// its axis, a·I(ω_base + a ω_wheel), signed; and last "total", the size of the angular momentum of all bodies about the
/// world's origin, without sign. Empty where no wheel is an element. Cost: reads the log of records once.
std::vector<MomentumRow> wheel_momentum(const Scene& scene, const Assembly& assembly,
                                        const std::filesystem::path& log);

}  // namespace porthos::scene
