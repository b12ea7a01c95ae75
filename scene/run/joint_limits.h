#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/run/record_log.h"

namespace porthos::scene {

struct Scene;
struct Assembly;
struct RunReport;

/// Whether joints stay within the positions of the model file, which nothing enforces without an
/// element, from the records of a run; with [run] extrema at all steps.
class JointLimits {
 public:
  /// Joints whose limits act as elements are left out.
  JointLimits(const Scene& scene, const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !joints_.empty(); }
  /// Adds a record, a row of the layout.
  void see(std::span<const double> record);
  /// Adds one note on the joints that were beyond a limit. Of the worst ones (`most_told`) it says
  /// how far they went and when, or that they start beyond it. Of the others it has the names.
  void fill(RunReport& report) const;

 private:
  struct Joint {
    std::string name;
    size_t q;
    std::optional<size_t> turn;  ///< none: a slide
    std::optional<double> lower, upper;
    bool at_start = false;                      ///< whether it begins beyond
    double beyond = 0, position = 0, time = 0;  ///< there, else the worst
  };
  void see(Joint& joint, double z, double time) const;
  RecordLayout layout_;
  std::vector<Joint> joints_;
  std::vector<std::int64_t> turns_;
  bool begun_ = false;
};

}  // namespace porthos::scene
