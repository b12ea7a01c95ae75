#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "scene/read/scene.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// The checks of a case that do not hold, as the bits of a number: bit k is that of names()[k].
class CaseChecks {
 public:
  explicit CaseChecks(const Scene& scene);

  /// As in summary.json; the last is "another", for all that have no name here.
  const std::vector<std::string>& names() const { return names_; }
  /// Whether the end was reached is no part of it: the status of the case says that.
  std::int64_t failed(const RunReport& report) const;
  std::vector<std::string> names_of(std::int64_t failed) const;

 private:
  std::vector<std::string> names_;
};

}  // namespace porthos::scene
