#include "scene/sensitivity/ridders.h"

#include <algorithm>
#include <cmath>

namespace porthos::scene {

Differences ridders(const std::function<std::span<const double>(double d)>& f, std::size_t n,
                    double step, double rounding) {
  constexpr std::size_t levels = 12;
  Differences best{std::vector<double>(n, NAN), std::vector<double>(n, HUGE_VAL)};
  std::vector<std::vector<double>> before, row(levels, std::vector<double>(n));
  std::vector<double> noise(n);
  for (std::size_t i = 0; i < levels; ++i, step /= 2) {
    const auto up = f(step);
    std::copy(up.begin(), up.end(), row[0].begin());
    const auto down = f(-step);
    for (std::size_t k = 0; k < n; ++k) {
      noise[k] = rounding * (std::fabs(row[0][k]) + std::fabs(down[k])) / step;
      row[0][k] = (row[0][k] - down[k]) / (2 * step);
    }
    double four = 4;
    for (std::size_t j = 1; j <= i; ++j, four *= 4)
      for (std::size_t k = 0; k < n; ++k) {
        const double a = row[j - 1][k], b = before[j - 1][k], c = a + (a - b) / (four - 1);
        row[j][k] = c;
        const double error = std::max(std::fabs(c - a), std::fabs(c - b)) + noise[k];
        if (!(error < best.error[k])) continue;
        best.error[k] = error;
        best.slope[k] = c;
      }
    before = row;
  }
  return best;
}

}  // namespace porthos::scene
