#include "scene/wheel_momentum.h"

#include <algorithm>
#include <cmath>

#include "mechanics/momentum.h"
#include "scene/record_log.h"
#include "scene/scene.h"

namespace porthos::scene {
namespace {

void see(MomentumRow& row, bool first, double value) {
  if (first) row.start = value;
  row.end = value;
  row.largest = std::max(row.largest, std::fabs(value));
}

}  // namespace

std::vector<MomentumRow> wheel_momentum(const Scene& scene, const Assembly& assembly,
                                        const std::filesystem::path& log) {
  std::vector<MomentumRow> rows;
  if (!assembly.mechanism) return rows;
  const auto& m = *assembly.mechanism;
  const size_t nq = size_t(m.nq());
  std::vector<size_t> at;  // of each wheel's momentum in the state
  for (const Element& e : scene.elements)
    if (e.wheel_gain) {
      rows.push_back({e.joint});
      at.push_back(nq + size_t(m.coordinate(e.joint).q));
    }
  if (rows.empty()) return rows;
  rows.push_back({"total"});

  const RecordLayout layout(assembly.model->description(), scene.extrema);
  mechanics::Workspace<double> w(m);
  RecordReader reader(log, layout);
  std::vector<double> records;
  bool first = true;
  while (const size_t n = reader.read(records, 4096))
    for (size_t i = 0; i < n; ++i, first = false) {
      const auto x =
          std::span<const double>(records).subspan(i * layout.size() + layout.x(), layout.nx);
      for (size_t k = 0; k < at.size(); ++k) see(rows[k], first, x[at[k]]);
      const auto L = mechanics::momentum<double>(m, w, x.first(nq), x.subspan(nq, nq)).angular;
      see(rows.back(), first, std::hypot(L.x, L.y, L.z));
    }
  return rows;
}

}  // namespace porthos::scene
