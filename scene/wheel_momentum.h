#pragma once
#include <array>
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

/// What a thruster or torquer has given over a run, in world (in orbit: inertial) axes.
struct ImpulseRow {
  std::string name, type;  ///< type: "thruster" or "torquer"
  std::array<double, 3> impulse{},
      angular{};    ///< [N s], [N m s]; about the world's origin, in orbit the centre of mass
  double on_s = 0;  ///< seconds on, of a thruster
  double propellant_kg =
      0;  ///< thrust time / (specific impulse g0); 0 where that is not given. Masses stay as they are.
};
struct Impulses {
  std::vector<ImpulseRow> rows;
  /// Largest |P - P(0) - Σ impulses| and the same of L at the records, over the largest |P|, |L|; of free space only.
  double linear_left = 0, angular_left = 0;
};
/// From the log's observed works and states. Empty without thrusters and torquers. Cost: reads the log once.
Impulses impulses(const Scene& scene, const Assembly& assembly, const std::filesystem::path& log);

}  // namespace porthos::scene
