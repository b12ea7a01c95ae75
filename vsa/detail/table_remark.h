#pragma once
#include <map>
#include <string>
#include <vector>

#include "vsa/table.h"

namespace porthos::vsa {

/// Torques as measured, over the deflections of one setting of σ.
struct MeasuredCurve {
  std::vector<double> x, y;
};
using MeasuredCurves = std::map<double, MeasuredCurve>;  ///< by σ

/// What is odd about a table that can be used, a sentence; empty: nothing.
std::string remark_on(const Measurements& m, const MeasuredCurves& curves,
                      const TorqueErrors& errors, const std::string& path);

}  // namespace porthos::vsa
