#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "phs/system/archive.h"
#include "phs/system/energy_scale.h"
#include "phs/system/state.h"
#include "scene/run/measure.h"
#include "scene/run/run_report.h"
#include "scene/run/statistics.h"

namespace porthos::scene {

/// The ledger of a run: stored energies, works of every power, and the statistics of the energy
/// error.
///
/// The energy error is the defect of the balance, H - H(start) - supplied + dissipated; it is H -
/// H(start) where nothing is supplied or dissipated. The method computes the works, step by step,
/// with its own weights (integrators/core/port_work.h); they are summed in double length.
class Ledger {
 public:
  explicit Ledger(const phs::Description& d);

  /// Adds a step. works: of each of the system's powers [J].
  void book(std::span<const double> works) {
    for (size_t a = 0; a < works.size(); ++a) {
      phs::compensated_add(sum_[a], low_[a], works[a]);
      peak_[a] = std::max(peak_[a], sum_[a]);
      if (description_->powers[a].kind != phs::PowerKind::observed)
        turned_over_ += std::fabs(works[a]);
    }
  }
  /// Adds a record. @return the energy error [J]. regular: as in ErrorStatistics.
  double add(double t, const Measured& m, bool regular);
  /// Adds a measurement between records, which is part of everything except means and statistics.
  /// @return the energy error [J]. Allocates nothing.
  double look(const Measured& m);
  /// Work of each of the system's powers since the start [J].
  const std::vector<double>& port_work() const { return sum_; }

  /// Fills energy, momentum, quaternion and balance entries of a report.
  void fill(RunReport& report, const Meter& meter) const;

  std::vector<double> memory() const;
  void restore(std::span<const double> memory);
  void carry(Archive& archive);

 private:
  struct Totals {
    double t = 0;  ///< of the last record
    double stored_J = 0;
    double max_error_J = 0, max_linear = 0, max_angular = 0, max_quaternion_norm = 0;
    double max_gap = 0, max_slip = 0;
    double max_linear_scale = 0, max_angular_scale = 0;
    double looks = 0;  ///< between records
  };
  double error(const Measured& m) const;
  using Numbers = std::array<double, sizeof(Totals) / sizeof(double)>;
  const phs::Description* description_;
  Totals totals_;
  ErrorStatistics energy_;  ///< of the records
  phs::EnergyScale scale_;
  std::vector<double> sum_, low_;              ///< per power
  std::vector<double> peak_;                   ///< per power, the largest sum so far
  double turned_over_ = 0;                     ///< Σ |works|
  std::vector<double> stored_first_, stored_;  ///< per storage: at the start, at the last record
};

}  // namespace porthos::scene
