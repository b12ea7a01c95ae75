#pragma once
#include <memory>
#include <span>
#include <vector>

#include "scene/assemble/stops.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// What a run shows of each [[stop]] with outcome = "fail" or "judge": the largest StopValue at the
/// ends of its steps.
class StopValues {
 public:
  /// Scene and assembly must outlive it. @throws InvalidArgument as StopValue
  StopValues(const Scene& scene, const Assembly& assembly);

  bool any() const { return !stops_.empty(); }
  /// Looks at a state. Cost: a pass of Outputs a stop. Allocates nothing after the first call.
  /// @param held  as StopValue::at()
  void see(double t, const phs::State& s, std::span<const double> held);
  /// Adds a check for each stop, which fails if the stop has ended the run, or if the value of one
  /// that judges has passed its limit; or why there is none:
  /// it begins later than the run ended, or its output had no value.
  void fill(RunReport& report) const;

  const std::vector<double>& memory() const { return largest_; }
  /// @throws InvalidArgument if the size does not fit
  void restore(std::span<const double> memory);

 private:
  std::vector<std::unique_ptr<StopValue>> stops_;
  std::vector<double> largest_;  ///< -HUGE_VAL: none
};

/// Of the row of a stop among the checks: "stop.NAME", of one `below` with a mark.
std::string name_of_check(const Stop& stop);

}  // namespace porthos::scene
