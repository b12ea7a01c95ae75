#include "scene/run/row_times.h"

#include <algorithm>
#include <cmath>

namespace porthos::scene {
namespace {

/// The time between rows; if unequal, that in the middle.
double middle_step(const std::vector<double>& t) {
  std::vector<double> steps;
  for (size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  const double mean = (t.back() - t[0]) / double(steps.size());
  if (std::all_of(steps.begin(), steps.end(),
                  [&](double h) { return std::fabs(h - mean) < 1e-6 * mean; }))
    return mean;
  std::nth_element(steps.begin(), steps.begin() + long(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

}  // namespace

Rows::Rows(const std::vector<double>& times) : t(times), step(middle_step(times)) {
  for (size_t i = 1; i < t.size(); ++i) others += !(std::fabs(interval(i) - step) < 1e-6 * step);
  equal = others == 0;
  mostly_equal = 2 * others <= t.size();
}

bool Rows::resolve(size_t i) const {
  if (i < 2 || i + 1 >= t.size()) return false;
  return !is_hole(i - 1) && !is_hole(i) && !is_hole(i + 1);
}

std::vector<size_t> Rows::holes() const {
  std::vector<size_t> all;
  for (size_t i = 1; i < t.size(); ++i)
    if (is_hole(i)) all.push_back(i);
  return all;
}

std::vector<double> before_holes(const std::vector<double>& times) {
  std::vector<double> all;
  if (times.size() < 3) return all;
  for (const size_t i : Rows(times).holes()) all.push_back(times[i - 1]);
  return all;
}

}  // namespace porthos::scene
