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

/// An angular momentum over a run, at its records [N m s].
struct MomentumRow {
  std::string name;
  double start = 0, end = 0, largest = 0;  ///< largest: of its size
};

/// What a thruster or torquer has given over a run, in world (in orbit: inertial) axes.
struct ImpulseRow {
  std::string name, type;  ///< type: "thruster" or "torquer"
  /// [N s], [N m s]; about the world's origin, in orbit the centre of mass
  std::array<double, 3> impulse{}, angular{};
  double on_s = 0;  ///< seconds on, of a thruster
  /// thrust time / (specific impulse g0); 0 where that is not given. Masses stay as they are.
  double propellant_kg = 0;
};
struct Impulses {
  std::vector<ImpulseRow> rows;
  /// Largest |P - P(0) - Σ impulses| and the same of L at the records, over the largest |P|, |L|;
  /// of free space only.
  double linear_left = 0, angular_left = 0;
};

/// What the records of a run say of the momenta its wheels hold and its thrusters give.
///
/// Of the wheels: per wheel the momentum conjugate to its joint, that is its whole angular momentum
/// about its axis, a·I(ω_base + a ω_wheel), signed; and last "total", the size of the angular
/// momentum of all bodies about the world's origin, without sign. Nothing where no wheel is an
/// element. Of thrusters and torquers: from the observed works and the states.
class MomentumLedger {
 public:
  /// The scene and the assembly must outlive it.
  MomentumLedger(const Scene& scene, const Assembly& assembly, const RecordLayout& layout);
  /// Whether there is anything to keep a ledger of.
  bool any() const { return !wheels_.empty() || !given_.rows.empty(); }
  /// Books a record, a row of the layout. Allocates nothing.
  void see(std::span<const double> record);
  /// Books every record of a log.
  void read(const std::filesystem::path& log);
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
  std::vector<size_t> wheel_at_;  ///< of each wheel's momentum in the state
  Impulses given_;
  std::vector<At> given_at_;
  mechanics::Momentum<double> start_{};
  double from_ = 0, to_ = 0, largest_P_ = 0, largest_L_ = 0;
  std::vector<std::int64_t> turns_;
  bool first_ = true;
};

}  // namespace porthos::scene
