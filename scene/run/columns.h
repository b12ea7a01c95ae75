#pragma once
#include <string>
#include <vector>

#include "phs/system/description.h"
#include "scene/files/hdf5_file.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

/// A series of the records, by the name it has in run.h5, in the report and in Python.
struct Column {
  std::string name, unit;  ///< docs/results.md: "state/arm", "stored/kinetic", "minimum/state/arm"
  size_t first;            ///< its first number in a row of RecordLayout
  size_t columns = 1;
  bool matrix = false;   ///< two-dimensional, even with one column
  bool integer = false;  ///< bits of 64-bit integers, see integer()
};

/// All series of a record, in the order of run.h5.
std::vector<Column> columns_of(const phs::Description& d, const RecordLayout& layout);

/// The names behind the columns of "turns".
std::vector<std::string> turn_names(const phs::Description& d);

}  // namespace porthos::scene
