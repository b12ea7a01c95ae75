// The critical points of a shaped potential.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/certify/detail/shaped_potential.h"

namespace porthos::energy_shaping {
namespace {

using Vec = std::vector<double>;

bool inside(const Region& r, const Vec& q) {
  for (size_t a = 0; a < q.size(); ++a)
    if (q[a] < r.lower[a] || q[a] > r.upper[a]) return false;
  return true;
}

constexpr double tiny = 1e-9;  ///< of V_d's changes over the region: more than its rounding

/// The eigenvalues of the Hessian in units of the region's widths: changes of V_d over it.
Vec bends(ShapedPotential& V, const Region& r, const Vec& q) {
  const size_t n = q.size();
  Vec g, K;
  V.gradient(q, g, K);
  for (size_t i = 0; i < n * n; ++i)
    K[i] *= (r.upper[i / n] - r.lower[i / n]) * (r.upper[i % n] - r.lower[i % n]);
  return phs::symmetric_eigenvalues(n, K);
}

/// The coordinates along which a critical point has others of the same V_d next to it. An isolated
/// one, of a small Hessian too, has none: Newton's method returns to it.
std::vector<size_t> flat_along(ShapedPotential& V, const Region& r, const Vec& q, double rounding) {
  const auto aside = [&](size_t a) { return 0.01 * (r.upper[a] - r.lower[a]); };
  std::vector<bool> moves(q.size(), false);
  for (size_t a = 0; a < q.size(); ++a) {
    Vec next = q;
    next[a] += aside(a);
    if (!V.refine(next, r) || std::fabs(V(next) - V(q)) > rounding) continue;
    for (size_t b = 0; b < q.size(); ++b)
      if (std::fabs(next[b] - q[b]) > 0.5 * aside(b)) moves[b] = true;
  }
  std::vector<size_t> flat;
  for (size_t a = 0; a < q.size(); ++a)
    if (moves[a]) flat.push_back(a);
  return flat;
}

/// @param found  the points before it
CriticalPoint described(ShapedPotential& V, const Region& r, const Vec& q,
                        const std::vector<CriticalPoint>& found) {
  const Vec all = bends(V, r, q);
  const double rounding = tiny * std::max(std::fabs(all.front()), std::fabs(all.back()));
  CriticalPoint p{q, V(q), 0, flat_along(V, r, q, rounding)};
  for (const double k : all) p.descending += k < (p.flat.empty() ? 0 : -rounding);
  p.again = !p.flat.empty() && std::ranges::any_of(found, [&](const CriticalPoint& first) {
    return !first.again && first.flat == p.flat && first.descending == p.descending &&
           std::fabs(first.value - p.value) <= rounding;
  });
  return p;
}

/// @throws InvalidArgument for another number of coordinates, a region without the rest point
///   inside, and one with an end for which the law is not meant (ClosedLoop::hindrance)
void check_region_of(const ClosedLoop& loop, const Region& r) {
  const size_t n = loop.rest().size() / 2;
  require_size("region.lower", r.lower.size(), n);
  require_size("region.upper", r.upper.size(), n);
  for (size_t a = 0; a < n; ++a) {
    if (const double q = loop.rest()[a]; !(r.lower[a] < q && q < r.upper[a]))
      throw InvalidArgument(fmt::format(
          "the region of '{}' is {:g} to {:g}, expected the rest point's {:g} between them",
          coordinate_names(loop.plant().description())[a], r.lower[a], r.upper[a], q));
    for (const double end : {r.lower[a], r.upper[a]}) {
      Vec x = loop.rest();
      x[a] = end;
      if (const auto why = loop.hindrance(x); !why.empty())
        throw InvalidArgument("narrow the region: " + why);
    }
  }
}

}  // namespace

std::vector<CriticalPoint> critical_points(const ClosedLoop& loop, const Region& region,
                                           int starts) {
  check_region_of(loop, region);
  ShapedPotential V(loop);
  std::mt19937_64 generator(region.seed);
  std::vector<CriticalPoint> found;
  for (int i = 0; i < starts; ++i) {
    Vec q = random_coordinates(region, generator);
    if (i == 0) q.assign(loop.rest().begin(), loop.rest().begin() + long(V.size()));
    if (!V.refine(q, region) || !inside(region, q)) continue;
    const bool known = std::any_of(found.begin(), found.end(), [&](const CriticalPoint& p) {
      for (size_t a = 0; a < q.size(); ++a)
        if (std::fabs(p.q[a] - q[a]) > 1e-6 * (region.upper[a] - region.lower[a])) return false;
      return true;
    });
    if (known) continue;
    found.push_back(described(V, region, q, found));
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.value < b.value; });
  return found;
}

}  // namespace porthos::energy_shaping
