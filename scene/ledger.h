#pragma once
#include <array>
#include <span>
#include <vector>

#include "scene/measure.h"
#include "scene/run.h"
#include "scene/statistics.h"

namespace porthos::scene {

/// Sums up the records of a run: energy balance, statistics of its error, largest errors.
///
/// The energy error is the defect of the power balance, H - H(start) + dissipated: H - H(start) of
/// a lossless system.
/// The dissipated energy of others is the trapezoidal rule over the records, whose own error then
/// stands in the defect.
class Ledger {
 public:
  /// @return the energy error [J]. regular: as in ErrorStatistics.
  double add(double t, const Measured& m, bool regular);

  /// Fills energy, momentum, quaternion and balance entries of a report.
  void fill(RunReport& report, const Meter& meter) const;

  std::vector<double> memory() const;
  void restore(std::span<const double> memory);

 private:
  struct Totals {
    double t = 0, power_W = 0;  ///< of the last record
    double dissipated_J = 0, stored_J = 0;
    double max_kinetic_J = 0, max_linear = 0, max_angular = 0, max_quaternion_norm = 0;
    double max_linear_scale = 0, max_angular_scale = 0;
  };
  using Numbers = std::array<double, sizeof(Totals) / sizeof(double)>;
  Totals totals_;
  ErrorStatistics energy_;
};

}  // namespace porthos::scene
