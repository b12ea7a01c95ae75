#pragma once
#include <string>
#include <vector>

#include "scene/run/columns.h"
#include "scene/session/memory_run.h"
#include "tests/run/scenes.h"

namespace porthos::test {

/// The records of a run in memory as series.
struct Series {
  scene::RunReport report;
  scene::Assembly assembly;
  std::vector<std::vector<double>> rows;
  std::vector<scene::Column> columns;

  explicit Series(const scene::Scene& s) : assembly(scene::assemble(s)) {
    scene::MemoryOptions o;
    o.record = [this](std::span<const double> row) { rows.emplace_back(row.begin(), row.end()); };
    report = scene::run_in_memory(s, assembly, o);
    columns = scene::columns_of(assembly.model->description(), scene::RecordLayout(s, assembly));
  }
  std::vector<double> operator()(const std::string& name) const {
    std::vector<double> all;
    for (const auto& c : columns)
      if (c.name == name)
        for (const auto& row : rows)
          for (size_t i = 0; i < c.columns; ++i) all.push_back(row[c.first + i]);
    return all;
  }
};

}  // namespace porthos::test
