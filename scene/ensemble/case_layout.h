#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mechanics/reconfiguration.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

namespace porthos::scene {

/// Columns of the numbers of a last state, by their names: "elbow", "p(elbow)", "base.attitude[0]".
///
/// A case whose mechanism changes ends in one of several mechanisms. There is a column for every
/// number of any of them, those of the start first. So a name means the same in every case,
/// whatever happened in it.
class StateColumns {
 public:
  /// @param models  the systems in which a case may end, that of the start first
  explicit StateColumns(std::span<const std::shared_ptr<const phs::Model>> models);

  const std::vector<std::string>& numbers() const { return numbers_; }
  const std::vector<std::string>& angles() const { return angles_; }

  /// Puts a state in its columns; a column that its system has no number for becomes NaN (turns:
  /// 0).
  /// @throws InvalidArgument for a number that has no column
  void put(const phs::Description& d, const phs::State& s, std::span<double> x,
           std::span<double> lo, std::span<std::int64_t> turns) const;
  /// A locked joint keeps its position; it has no momentum.
  void put_locked(const std::string& joint, const mechanics::LockedJoint& at, std::span<double> x,
                  std::span<double> lo, std::span<std::int64_t> turns) const;

 private:
  std::vector<std::string> numbers_, angles_;
  std::map<std::string, size_t> number_at_, angle_at_;
};

/// The results of a case of an ensemble: a row of 8-byte numbers, integers by their bits; the last
/// is a digest of the others.
struct CaseLayout {
  size_t columns, nx, turns, events;
  size_t outputs, stops;  ///< numbers of the scene's outputs; its stops
  CaseLayout(size_t columns_, const StateColumns& state, size_t events_, size_t outputs_ = 0,
             size_t stops_ = 0);

  // Integers; failed: of CaseChecks.
  static constexpr size_t index = 0, status = 1, steps = 2, passed = 3, failed = 4;
  static constexpr size_t energy_initial = 5, energy_scale = 6, energy_abs = 7, energy = 8,
                          energy_rms = 9, linear = 10, angular = 11, quaternion = 12;
  static constexpr size_t inputs = 13;
  size_t x() const { return inputs + columns; }
  size_t low() const { return x() + nx; }
  size_t turn() const { return low() + nx; }  ///< integers
  /// The time of each event [s] and the energy it dissipated [J]; NaN: it never happened.
  size_t event_time() const { return turn() + turns; }
  size_t event_loss() const { return event_time() + events; }
  /// Of each output its value at the end, the smallest and the largest one at the records.
  size_t output_end() const { return event_loss() + events; }
  size_t output_least() const { return output_end() + outputs; }
  size_t output_largest() const { return output_least() + outputs; }
  /// The time of the end [s], the index of the stop, -1: none, and the requirements that were not
  /// judged, of CaseChecks; if there are stops.
  size_t end_time() const { return output_largest() + outputs; }
  size_t stop() const { return end_time() + 1; }  ///< integer
  size_t open() const { return stop() + 1; }      ///< integer
  size_t digest() const { return end_time() + (stops > 0 ? 3 : 0); }
  size_t size() const { return digest() + 1; }

  /// Sets the digest of a row.
  void seal(std::span<double> row) const;
  bool sound(std::span<const double> row) const;
};

/// How a case ended, in addition to integrators::Outcome: it could not begin, or an event was
/// impossible.
inline constexpr int case_refused = 4, case_event_refused = 5;
const char* case_status(int status);

}  // namespace porthos::scene
