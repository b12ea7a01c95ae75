#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/read/actuator.h"
#include "scene/run/record_log.h"
#include "vsa/elastic.h"

namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// Whether the springs of actuators stay where their energies are known, from the records of a run:
/// σ in its range where no stop keeps it there, with [run] extrema at all steps; the deflection in
/// the range that was measured, and the stiffness not negative, at the records.
class SpringRanges {
 public:
  /// The scene must outlive it.
  SpringRanges(const Scene& scene, const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !springs_.empty() || !remarks_.empty() || !kinks_.empty(); }
  /// Adds a record, a row of the layout.
  void see(std::span<const double> record);
  /// Adds a note for each range that was left and each stiffness that was negative, the remarks on
  /// tables, and one on the steps of springs with kinks if the energy error is too large.
  void fill(RunReport& report) const;

 private:
  struct Range {
    std::string what;  ///< "deflection of actuator 'motor' [rad]"
    int of, less;      ///< numbers of the state: the value is x[of] - x[less]; less < 0: x[of]
    double lower, upper;
    const char* reason;
    double first = -1, farthest = 0;  ///< time of the first record beyond, and the worst value
    void see(double value, double time);
  };
  struct Spring {
    std::string name;
    const vsa::Elastic* elastic;
    ActuatorPlace at;
    double first = -1, least = 0;  ///< time of the first record of negative stiffness, least value
  };
  RecordLayout layout_;
  std::vector<Range> ranges_;
  std::vector<Spring> springs_;
  std::vector<std::string> remarks_, kinks_;  ///< kinks: what they are and where
  double most_;                               ///< energy error that passes
};

}  // namespace porthos::scene
