#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "scene/ensemble/ensemble.h"
#include "scene/run/record_log.h"

namespace porthos::test {

/// Every row of an ensemble, by its index.
inline std::vector<std::vector<double>> rows_of(const scene::Ensemble& e, int threads = 1) {
  std::vector<std::vector<double>> rows(size_t(e.cases().cases));
  std::int64_t next = 0;
  e.work([&] { return next < e.cases().cases ? next++ : -1; },
         [&](std::span<const double> row) {
           rows[size_t(scene::integer(row[0]))].assign(row.begin(), row.end());
         },
         {.threads = threads});
  return rows;
}

}  // namespace porthos::test
