#pragma once
#include "scene/run/contact_depths.h"
#include "scene/run/fast_swings.h"
#include "scene/run/joint_limits.h"
#include "scene/run/law_limits.h"
#include "scene/run/output_summary.h"
#include "scene/run/spring_ranges.h"
#include "scene/run/wheel_momentum.h"

namespace porthos::scene {

/// What a report takes from the records of a run.
class FromRecords {
 public:
  /// The scene and the assembly must outlive it.
  FromRecords(const Scene& scene, const Assembly& assembly, const RecordLayout& layout)
      : momenta_(scene, assembly, layout),
        springs_(scene, assembly, layout),
        limits_(assembly, layout),
        joints_(scene, assembly, layout),
        depths_(assembly, layout),
        swings_(assembly, layout),
        outputs_(scene, layout) {}
  /// Whether it needs records.
  bool any() const {
    return momenta_.any() || springs_.any() || limits_.any() || joints_.any() || depths_.any() ||
           swings_.any() || outputs_.any();
  }
  /// Adds a record, a row of the layout.
  void see(std::span<const double> record) {
    if (momenta_.any()) momenta_.see(record);
    springs_.see(record);
    limits_.see(record);
    joints_.see(record);
    depths_.see(record);
    swings_.see(record);
    outputs_.see(record);
  }
  void fill(RunReport& report) const {
    momenta_.fill(report);
    springs_.fill(report);
    joints_.fill(report);
    depths_.fill(report);
    swings_.fill(report);
    limits_.fill(report);
    outputs_.fill(report);
  }

 private:
  MomentumLedger momenta_;
  SpringRanges springs_;
  LawLimits limits_;
  JointLimits joints_;
  ContactDepths depths_;
  FastSwings swings_;
  OutputSummary outputs_;
};

}  // namespace porthos::scene
