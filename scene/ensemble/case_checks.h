#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "scene/read/scene.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// The checks of a case that do not hold, or that were not judged, as the bits of a number: bit k
/// is that of names()[k].
class CaseChecks {
 public:
  explicit CaseChecks(const Scene& scene);

  /// As in summary.json; the last is "another", for all that have no name here.
  const std::vector<std::string>& names() const { return names_; }
  /// Whether the end was reached is no part of it: the status of the case says that.
  std::int64_t failed(const RunReport& report) const;
  /// The requirements that were not judged: never looked at, or their output had no value.
  std::int64_t not_judged(const RunReport& report) const;
  /// Those of a case that did not reach its end: all that had not failed before.
  std::int64_t not_judged(std::int64_t failed) const { return requirements_ & ~failed; }
  std::vector<std::string> names_of(std::int64_t bits) const;

 private:
  std::int64_t bit_of(const std::string& name) const;
  std::vector<std::string> names_;
  std::int64_t requirements_ = 0;  ///< bits
};

}  // namespace porthos::scene
