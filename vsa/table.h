#pragma once
#include <string>
#include <vector>

#include "vsa/elastic.h"

/// Measured actuators: torque, stiffness and stiffness-port effort on a grid of deflections and σ,
/// made into an energy.
namespace porthos::vsa {

/// Numbers of the grid stand deflection by deflection, σ after σ: value(i, j) = values[j ·
/// deflections + i].
struct Measurements {
  std::vector<double> deflection;    ///< rises, has 0 in its range [rad]; three or more
  std::vector<double> sigma;         ///< rises; one or more
  std::vector<double> torque;        ///< ∂E/∂φ, what holds the deflection: rises with it [N m]
  std::vector<double> stiffness;     ///< ∂²E/∂φ² [N m/rad], or empty
  std::vector<double> sigma_effort;  ///< ∂E/∂σ, or empty: E(0, σ) is then taken as 0
};

/// Reads columns "deflection", "sigma", "torque" and, if there, "stiffness", "sigma_effort" of a
/// CSV file with a header, in any order of columns and rows. SI units. Lines that begin with # are
/// comments.
/// @throws InvalidArgument "file:line: ..." for a missing column or number, a place given twice or
///   a hole in the grid
Measurements read_measurements(const std::string& csv_file);
/// The same from a text that was read already; `path` stands for the file in messages.
Measurements parse_measurements(const std::string& text, const std::string& path);

/// E(φ, σ) = E0(σ) + ∫ τ dφ, the torques interpolated by natural cubic splines both ways (E is C³
/// in φ, C² in σ, linear torque outside). Cost of an evaluation: about 100 ns.
/// @param tolerance  relative; how far the columns may be from those of one energy, for noise
/// @throws InvalidArgument if torque does not rise with the deflection; if the stiffness is not the
///   torque's derivative; or if the table is of no energy: the work round a cell of the grid, ∮ τ
///   dφ + s dσ, is not 0
ElasticPtr tabulated(const Measurements& m, const Limits& l = {}, double tolerance = 0.02);

}  // namespace porthos::vsa
