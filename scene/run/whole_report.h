#pragma once
#include <string>

#include "mechanics/reconfiguration.h"
#include "scene/run/run_report.h"
#include "scene/run/whole_notes.h"

namespace porthos::scene {

/// The errors and the ledger of all phases of a run in one report: the largest errors, the sums of
/// the works, plastic losses among the losses, and the momenta across events among the checks.
class WholeReport {
 public:
  explicit WholeReport(const Scene& scene);

  /// @param from  when the phase began [s]
  void add(const RunReport& phase, double from);
  /// @param on_ground  the ground takes a part of the momenta, which are then no invariants
  void add(const Event& event, const mechanics::Impact& impact, bool on_ground);
  /// Adds a check; of those of one name the worst value counts.
  void worst(const Check& c);
  /// Adds the notes on the whole, after the last phase.
  void finish() { notes_.finish(r_); }
  RunReport& report() { return r_; }
  const RunReport& report() const { return r_; }

 private:
  void add_delivered(const RunReport& phase);
  void add_energy(const EnergyReport& phase, double from, bool first);
  static void add_impacts(std::vector<ImpactRow>& all, const ImpactRow& row);
  void add_momentum(const MomentumRow& row);
  void add_impulses(const Impulses& phase);
  void cannot(const NotApplicable& n);
  RunReport r_;
  PhaseNotes notes_;
};

}  // namespace porthos::scene
