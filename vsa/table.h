#pragma once
#include <string>
#include <vector>

#include "vsa/elastic.h"

/// Measured actuators: an energy from torque, stiffness and stiffness-port effort on a grid of
/// deflections and σ.
namespace porthos::vsa {

/// The standard deviations of the errors of measured torques.
struct TorqueErrors {
  double absolute = 0;  ///< of every torque [N m]
  double relative = 0;  ///< of each torque, as a share of its magnitude
  TorqueErrors(double absolute_ = 0, double relative_ = 0)
      : absolute(absolute_), relative(relative_) {}
  bool any() const { return absolute > 0 || relative > 0; }
  /// Of torques, each the mean of so many rows; no numbers: of one each.
  std::vector<double> of(const std::vector<double>& torques,
                         const std::vector<double>& of_rows = {}) const;
};

/// A torque as it was measured.
struct MeasuredTorque {
  double deflection, sigma, torque;  ///< [rad], that of the table, [N m]
};

/// Columns are stored with the deflection as the fast index: value(i, j) = values[j · deflections +
/// i].
struct Measurements {
  std::vector<double> deflection;  ///< ascending, with 0 in its range [rad]; three or more
  std::vector<double> sigma;       ///< ascending; one or more
  std::vector<double> torque;      ///< ∂E/∂φ, holds the deflection and increases with it [N m]
  std::vector<double> stiffness;   ///< ∂²E/∂φ² [N m/rad], or empty
  std::vector<double> sigma_effort;   ///< ∂E/∂σ, or empty: E(0, σ) is then 0
  bool without_errors = false;        ///< the torques are smoothed already
  TorqueErrors errors_to_state = {};  ///< in place of those that are too small; none: not known
  double one_setting = 0;   ///< settings of σ that differ by less were taken as one, by their mean
  std::string remark = {};  ///< what is odd about it, a sentence for people; empty: nothing
  std::vector<MeasuredTorque> rows = {};  ///< of the file, in its order; empty: not from a file
};

/// Reads columns "deflection", "torque" and, if present, "sigma" (else 0), "stiffness",
/// "sigma_effort" of a CSV file (phs/csv_table.h), with columns and rows in any order. SI units.
/// Other columns are not used; the remark names them.
/// @param errors  of the torques. If there are any, the places need be no grid, and may be repeated
///   (loading and unloading): the curve of each σ is smoothed through its own places and taken at
///   evenly spaced deflections, at most 200. Places nearer than half of that spacing are one, with
///   the mean of loading and unloading, the means of their numbers; the error of a mean is less by
///   the root of how many rows it has. Where a setting of σ has fewer than four places, as one that
///   is measured and jitters, settings that follow each other by less than 1/50 of their range are
///   one
/// @throws InvalidArgument "file:line: ..." for a missing column or number, a column that may be a
///   misspelt one, and without smoothing for a duplicate grid point or a hole in the grid
Measurements read_measurements(const std::string& csv_file, const TorqueErrors& errors = {});
/// The same from a text; `path` replaces the file name in messages.
Measurements parse_measurements(const std::string& text, const std::string& path,
                                const TorqueErrors& errors = {});

/// E(φ, σ) = E0(σ) + ∫ τ dφ, with the torques interpolated by natural cubic splines in both
/// directions (E is C³ in φ, C² in σ, linear torque outside). A range of σ that l leaves open is
/// that of the table. Cost of an evaluation: about 100 ns.
/// @param tolerance  relative deviation of the columns from a single energy, to allow for noise
/// @param errors  if there are any, the torques of each σ are replaced by those of the curve that
///   bends least among those as far from them as their errors (phs::smoothed)
/// @throws InvalidArgument if torque does not increase with deflection, if the splines have a
/// stiffness below 0 anywhere, if the stiffness is not the torque's derivative, or if no energy
/// fits the table: the work around a cell of the grid, ∮ τ dφ + s dσ, is not 0
ElasticPtr tabulated(const Measurements& m, const Limits& l = {}, double tolerance = 0.02,
                     const TorqueErrors& errors = {});

/// The rows of the file that a tabulated energy is from; empty: of another one.
std::vector<MeasuredTorque> measured_torques(const Elastic& energy);
/// The torque by which these rows lie above the energy's curve while the deflection rises, less
/// that while it falls: the width of a hysteresis loop, of the setting where it is widest [N m].
/// 0: not told from noise, which takes eight rows each way and a mean of five standard errors.
double measured_loop(const Elastic& energy);
/// The settings of σ of a tabulated energy, ascending; empty: of another one.
std::vector<double> measured_settings(const Elastic& energy);

}  // namespace porthos::vsa
