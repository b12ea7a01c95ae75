#pragma once
#include <algorithm>
#include <cmath>

/// Zeros of a function of the length of a step. A Point has `at`, a fraction of the step, and `g`,
/// the value of the function there.
namespace porthos::integrators {

inline int sign_of(double x) { return (x > 0) - (x < 0); }

/// The zero of the line through two points.
template <class Point>
double secant(Point a, Point b) {
  return a.at - a.g * ((b.at - a.at) / (b.g - a.g));
}

/// The zero between a and b of a cheap function g(at), the dense output, to a few digits. NaN or 0
/// end the search.
template <class Point, class G>
double guess_zero(Point a, Point b, const G& g) {
  double at = secant(a, b);
  for (int i = 0; i < 12; ++i) {
    const Point p{at, g(at)};
    if (!(std::fabs(p.g) > 0)) break;    // 0, or no dense output
    if (sign_of(p.g) == sign_of(b.g)) {  // Illinois
      b = p;
      a.g *= 0.5;
    } else {
      a = p;
      b.g *= 0.5;
    }
    const double next = secant(a, b);
    if (std::fabs(next - at) < 1e-9) return next;
    at = next;
  }
  return at;
}

/// The zero between a and b of g(at) by bracketed secants from `first`, until `at` no longer
/// changes or g no longer shrinks; after `most` values it is the best so far. A value NaN ends it.
template <class Point, class G>
Point refine_zero(Point a, Point b, double first, int most, const G& g) {
  Point best = std::fabs(a.g) < std::fabs(b.g) && a.at > 0 ? a : b;
  Point last = best;
  const double size = std::max(std::fabs(a.g), std::fabs(b.g));
  double at = first > a.at && first < b.at ? first : secant(a, b);
  int without_progress = 0;
  for (int i = 0; i < most && b.at - a.at > 0x1p-52; ++i) {
    if (!(at > a.at && at < b.at)) at = 0.5 * (a.at + b.at);
    const Point p{at, g(at)};
    if (std::isnan(p.g)) return best;
    if (sign_of(p.g) == sign_of(a.g))
      a = p;
    else
      b = p;
    if (std::fabs(p.g) < std::fabs(best.g)) {
      best = p;
      without_progress = 0;
    } else
      ++without_progress;
    if (p.g == 0) break;
    // Two trials without progress so close to 0 are noise of g.
    if (without_progress >= 2 && std::fabs(best.g) < 1e-9 * size) break;
    const double next = p.g == last.g || i % 8 == 7 ? 0.5 * (a.at + b.at) : secant(p, last);
    if (std::fabs(next - at) < 0x1p-53) break;
    last = p;
    at = next;
  }
  return best;
}

}  // namespace porthos::integrators
