#include "scene/run/output_summary.h"

#include <algorithm>
#include <cmath>

#include "scene/run/run_report.h"

namespace porthos::scene {

OutputSummary::OutputSummary(const Scene& scene, const RecordLayout& layout) : layout_(layout) {
  for (size_t k = 0; k < layout.outputs.size(); ++k)
    for (auto& name : component_names(scene.outputs[k]))
      rows_.push_back({std::move(name), layout.outputs[k].unit});
  for (size_t k = 0; k < rows_.size(); ++k) {
    least_.push_back(layout.least(layout.output() + k));
    largest_.push_back(layout.largest(layout.output() + k));
  }
}

void see_output(OutputRow& row, double value) {
  row.end = value;
  row.least = std::fmin(row.least, value);
  row.largest = std::fmax(row.largest, value);
}

void OutputSummary::see(std::span<const double> record) {
  for (size_t k = 0; k < rows_.size(); ++k) {
    OutputRow& r = rows_[k];
    r.end = record[layout_.output() + k];
    if (first_) r.start = r.least = r.largest = r.end;
    r.least = std::fmin(r.least, record[least_[k]]);  // of numbers: a locked joint has none
    r.largest = std::fmax(r.largest, record[largest_[k]]);
  }
  first_ = false;
}

void OutputSummary::fill(RunReport& report) const { report.outputs = rows_; }

void add_outputs(std::vector<OutputRow>& all, const std::vector<OutputRow>& later) {
  if (all.empty()) {
    all = later;
    return;
  }
  for (size_t k = 0; k < all.size() && k < later.size(); ++k) {
    all[k].end = later[k].end;
    all[k].least = std::fmin(all[k].least, later[k].least);
    all[k].largest = std::fmax(all[k].largest, later[k].largest);
  }
}

}  // namespace porthos::scene
