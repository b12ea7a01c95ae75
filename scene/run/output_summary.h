#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "scene/run/record_log.h"

namespace porthos::scene {

struct RunReport;

/// A number of an [[output]] over a run: at its records, with [run] extrema = "all" at all steps.
struct OutputRow {
  std::string name, unit;
  double start = 0, end = 0, least = 0, largest = 0;
};

/// Adds a later value to a row. NaN has no extremum: a locked joint has none.
void see_output(OutputRow& row, double value);

/// The outputs of a run, from its records.
class OutputSummary {
 public:
  OutputSummary(const Scene& scene, const RecordLayout& layout);
  bool any() const { return !rows_.empty(); }
  /// Adds a record, a row of the layout.
  void see(std::span<const double> record);
  /// Sets `outputs`.
  void fill(RunReport& report) const;

 private:
  RecordLayout layout_;
  std::vector<OutputRow> rows_;
  /// Columns of the extrema since the record before; of the number itself where none are recorded.
  std::vector<size_t> least_, largest_;
  bool first_ = true;
};

/// Adds the outputs of a later phase to those before it.
void add_outputs(std::vector<OutputRow>& all, const std::vector<OutputRow>& later);

}  // namespace porthos::scene
