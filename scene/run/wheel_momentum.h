#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/momentum.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// An angular momentum over a run [N m s].
struct MomentumRow {
  std::string name;
  double start = 0, end = 0, largest = 0;  ///< largest: absolute value
  bool at_steps = false;  ///< the largest is that of all steps, by [run] extrema; else of records
};

/// Impulse of a thruster, wrench or torquer over a run, in world (in orbit: inertial) axes.
struct ImpulseRow {
  std::string name, type;  ///< "thruster", "wrench" or "torquer"
  /// [N s], [N m s]; about the world's origin, in orbit the centre of mass
  std::array<double, 3> impulse{}, angular{};
  double on_s = 0;  ///< time on, of a thruster [s]
  /// thrust time / (specific impulse g0); 0 where the latter is not given. Masses stay constant.
  double propellant_kg = 0;
};
struct Impulses {
  std::vector<ImpulseRow> rows;
  /// Largest |P - P(0) - Σ impulses| and the same for L at the records, over the largest |P|, |L|;
  /// in free space only.
  double linear_left = 0, angular_left = 0;
  bool integrated = true;  ///< with the motion; false: by two Gauss points of each step
};

/// Momenta of the wheels and impulses of the thrusters, from the records of a run.
///
/// For each wheel: the momentum conjugate to its joint, that is its whole angular momentum about
/// its axis, a·I(ω_base + a ω_wheel), signed. The last row, "total", is the magnitude of the
/// angular momentum of all bodies about the world's origin. Wheels are those of elements and of
/// controllers that turn some; without one there are no rows. Impulses of thrusters and torquers
/// come from the observed works and the states.
class MomentumLedger {
 public:
  /// The scene and the assembly must outlive it.
  MomentumLedger(const Scene& scene, const Assembly& assembly, const RecordLayout& layout);
  /// Whether there are wheels, thrusters or torquers.
  bool any() const { return !wheels_.empty() || !given_.rows.empty(); }
  /// Adds a record, a row of the layout. Allocates nothing.
  void see(std::span<const double> record);
  /// Sets `momentum` and `impulses`.
  void fill(RunReport& report) const;

 private:
  struct At {
    size_t impulse, angular;  ///< of a thruster or torquer, among the powers
  };
  void see_impulses(std::span<const double> record, const mechanics::Momentum<double>& now);

  const Scene& scene_;
  const Assembly& assembly_;
  RecordLayout layout_;
  std::optional<mechanics::Workspace<double>> workspace_;  ///< without a mechanism: none
  std::vector<MomentumRow> wheels_;
  std::vector<size_t> wheel_at_;  ///< of each wheel's momentum in a record
  Impulses given_;
  std::vector<At> given_at_;
  mechanics::Momentum<double> start_{};
  double from_ = 0, to_ = 0, largest_P_ = 0, largest_L_ = 0;
  std::vector<std::int64_t> turns_;
  bool first_ = true;
};

}  // namespace porthos::scene
