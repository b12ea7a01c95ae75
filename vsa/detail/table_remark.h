#pragma once
#include <map>
#include <string>
#include <vector>

#include "vsa/table.h"

namespace porthos::vsa {

/// Torques as measured, over the deflections of one setting of σ.
struct MeasuredCurve {
  std::vector<double> x, y;
  std::vector<double> way = {};  ///< 1: measured while the deflection rose, -1: while it fell
  /// How many rows each torque is the mean of; empty: one.
  std::vector<double> of_rows = {};
};
using MeasuredCurves = std::map<double, MeasuredCurve>;  ///< by σ

/// Half of the torque by which loading lies above unloading, where the places of the two differ and
/// a mean of at least five standard errors tells it from noise; else 0.
double half_loop(const MeasuredCurve& c);
/// What is to be stated in place of errors with which the stiffness of some setting swings as
/// errors do: a tenth more than the least with which none does. Where that flattens another
/// setting, whose torques scatter less, an error relative to each torque. None: none swings, or
/// nothing helps up to eight times as much, since the spring itself is so.
TorqueErrors errors_to_state(const MeasuredCurves& curves, const TorqueErrors& errors);
/// "0.17 N m" or "0.03 as relative_smoothing", not below what is to be stated.
std::string errors_text(const TorqueErrors& to_state);

/// What is odd about a table that can be used, a sentence; empty: nothing.
std::string remark_on(const Measurements& m, const MeasuredCurves& curves,
                      const TorqueErrors& errors, const std::string& path);

}  // namespace porthos::vsa
