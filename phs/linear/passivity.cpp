#include "phs/linear/passivity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "phs/error.h"

namespace porthos::phs {
namespace {

/// The integral, beyond the trapezoid, of the parabola through (t_i, p_i), (t_i+1, p_i+1) and
/// sample k between the first two: -h³/6 times its second divided difference.
std::optional<double> beyond_trapezoid(std::span<const double> t, std::span<const double> p,
                                       size_t i, size_t k) {
  if (k >= t.size() || t[k] == t[i] || t[k] == t[i + 1]) return {};  // no such sample, or a jump
  const double h = t[i + 1] - t[i], slope = (p[i + 1] - p[i]) / h;
  const double curvature = ((p[k] - p[i]) / (t[k] - t[i]) - slope) / (t[k] - t[i + 1]);
  return -h * h * h / 6 * curvature;
}

}  // namespace

PassivityReport passivity(std::span<const double> t, std::span<const double> p,
                          std::span<const double> H) {
  require_size("powers", p.size(), t.size());
  require_size("energies", H.size(), t.size());
  if (t.empty()) throw InvalidArgument("passivity: no data");
  PassivityReport r;
  double lowest = H[0], moved = 0, largest = std::fabs(H[0]);  // of H - ∫ u·y
  size_t lowest_at = 0;
  for (size_t i = 0; i + 1 < t.size(); ++i) {
    const double h = t[i + 1] - t[i];
    if (!(h >= 0) || !std::isfinite(p[i] + p[i + 1] + H[i] + H[i + 1]))
      throw InvalidArgument("passivity: after sample " + std::to_string(i) +
                            " time runs backwards or a number is not finite");
    if (h > 0) {
      const double trapezoid = h * (p[i] + p[i + 1]) / 2;
      const auto before = i > 0 ? beyond_trapezoid(t, p, i, i - 1) : std::nullopt;
      const auto after = beyond_trapezoid(t, p, i, i + 2);
      // With one parabola the stated error is its whole correction; with none it is the trapezoid's
      // own difference.
      const double b = before.value_or(after.value_or(0)), a = after.value_or(b);
      r.supplied += trapezoid + (a + b) / 2;
      r.quadrature += before && after   ? std::fabs(a - b) / 2
                      : before || after ? std::fabs(a)
                                        : h * std::fabs(p[i + 1] - p[i]) / 2;
      moved += std::fabs(trapezoid);
    }
    largest = std::max(largest, std::fabs(H[i + 1]));
    const double balance = H[i + 1] - r.supplied;
    if (balance < lowest) {
      lowest = balance;
      lowest_at = i + 1;
    }
    if (balance - lowest > r.violation) {
      r.violation = balance - lowest;
      r.from = lowest_at;
      r.to = i + 1;
    }
  }
  r.rounding = std::numeric_limits<double>::epsilon() * (double(t.size()) * moved + 4 * largest);
  return r;
}

}  // namespace porthos::phs
