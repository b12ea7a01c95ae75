#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/identification/observation.h"

namespace porthos::scene {

/// A column of a log that a run has too.
struct LogColumn {
  Observed of;
  double sigma = 0;            ///< standard deviation of its noise, in its unit; 0: not known
  std::vector<double> values;  ///< one for each time
};

/// What was measured, at increasing times from 0 on, the start of the scene.
struct Log {
  std::string path;           ///< in messages
  std::vector<double> times;  ///< [s]
  std::vector<LogColumn> columns;
  std::vector<std::string> unused;  ///< columns of the file that no number of a run is called like
};

/// The standard deviation of a log's noise, in the units of its columns. Empty: not known.
struct LogNoise {
  std::optional<double> of_all = {};  ///< of those that are not named
  std::map<std::string, double> by_name = {};
};

/// Columns by name, from a program.
using NamedColumns = std::map<std::string, std::vector<double>>;

/// Reads a log: CSV with names in its first line, or HDF5. Time is "time" or "t" [s]. Columns are
/// called as observable() says, or as run.h5 and its export ("output/tip[0]", "state/joint_1",
/// "state/base.position.0") or porthos judge ("joint_1", "v.joint_1", "v.base.position[0]") do.
/// @throws InvalidArgument with file and line: no time, times that do not increase or begin before
///   0, no column that a run has, a value that is no number; a noise that is no positive number, of
///   no column or of some columns only; columns of several units without a noise
Log read_log(const std::string& path, const LogNoise& noise, const Scene& scene,
             const Assembly& assembly);
/// The same from columns, of equal lengths.
/// @throws InvalidArgument likewise; for a name that a run does not have
Log log_of(const NamedColumns& columns, const LogNoise& noise, const Scene& scene,
           const Assembly& assembly);

}  // namespace porthos::scene
