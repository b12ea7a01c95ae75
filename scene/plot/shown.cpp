#include "scene/plot/shown.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <random>

namespace porthos::scene {

std::vector<std::int64_t> thinned(std::int64_t count, std::int64_t most) {
  if (count <= most || most < 3) return evenly(count, most);
  std::vector<std::int64_t> rows{0};
  const std::int64_t parts = most - 2;
  std::minstd_rand draw;  // the same on every machine
  for (std::int64_t k = 0; k < parts; ++k) {
    const std::int64_t from = 1 + k * (count - 2) / parts, to = 1 + (k + 1) * (count - 2) / parts;
    rows.push_back(from + std::int64_t(draw()) % (to - from));
  }
  rows.push_back(count - 1);
  return rows;
}

std::vector<std::int64_t> evenly(std::int64_t count, std::int64_t most) {
  std::vector<std::int64_t> rows;
  const std::int64_t shown = std::min(count, most);
  for (std::int64_t k = 0; k < shown; ++k)
    rows.push_back(shown < 2 || count <= most
                       ? k
                       : std::llround(double(k) * double(count - 1) / double(shown - 1)));
  return rows;
}

Shown Shown::records(std::int64_t count, std::int64_t most) {
  Shown s;
  s.rows_ = thinned(count, most);
  return s;
}

Shown Shown::bands(std::int64_t count, std::int64_t most) {
  if (count <= most) return records(count, most);
  constexpr std::int64_t of_each = 16;
  const std::int64_t parts = std::max<std::int64_t>(1, most / 2);
  Shown s;
  s.rows_ = thinned(count, of_each * parts);
  const size_t n = s.rows_.size();
  for (std::int64_t k = 0; k <= parts; ++k) s.parts_.push_back(size_t(k) * n / size_t(parts));
  return s;
}

std::vector<double> Shown::picked(const std::vector<double>& all) const {
  std::vector<double> some;
  for (const auto k : rows_) some.push_back(all[size_t(k)]);
  return some;
}

std::vector<double> Shown::times(const std::vector<double>& t) const {
  assert(t.size() == rows_.size());
  if (parts_.empty()) return t;
  std::vector<double> shown;
  for (size_t k = 1; k < parts_.size(); ++k) {
    shown.push_back(t[parts_[k - 1]]);
    shown.push_back(t[parts_[k] - 1]);
  }
  return shown;
}

void Shown::reduce(std::vector<TracePanel>& panels) const {
  for (TracePanel& p : panels)
    for (TraceLine& l : p.lines) {
      l.t = times(l.t);
      l.value = values(l.value);
    }
}

std::vector<double> Shown::values(const std::vector<double>& v) const {
  assert(v.size() == rows_.size());
  if (parts_.empty()) return v;
  std::vector<double> shown;
  for (size_t k = 1; k < parts_.size(); ++k) {
    LeastAndLargest part;
    for (size_t i = parts_[k - 1]; i < parts_[k]; ++i) part.add(v[i]);
    shown.push_back(part.first());
    shown.push_back(part.second());
  }
  return shown;
}

}  // namespace porthos::scene
