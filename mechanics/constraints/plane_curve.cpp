#include "mechanics/constraints/plane_curve.h"

#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::mechanics {
namespace {

using phs::Quad;
using Points = std::vector<PlaneCurve::Point>;

constexpr int parts_of_a_step = 4;

double chord(const PlaneCurve::Point& a, const PlaneCurve::Point& b) {
  return std::hypot(b[0] - a[0], b[1] - a[1]);
}

void check_points(const Points& points, bool closed, const std::string& what) {
  const size_t n = points.size(), least = closed ? 3 : 2;
  const auto refuse = [&](const std::string& why) { throw InvalidArgument(what + ": " + why); };
  if (n < least)
    refuse("the number of points is " + std::to_string(n) + ", expected " + std::to_string(least) +
           " or more");
  const auto place = [&](size_t i) { return "point " + std::to_string(i % n + 1); };
  for (size_t i = 0; i < n; ++i)
    if (!std::isfinite(points[i][0]) || !std::isfinite(points[i][1]))
      refuse(place(i) + " is not finite");
  const size_t chords = closed ? n : n - 1;
  for (size_t i = 0; i < chords; ++i)
    if (points[i] == points[(i + 1) % n])
      refuse(place(i + 1) + " lies where the one before it does");
  for (size_t i = 1; i < chords + closed; ++i) {
    const double a = chord(points[i - 1], points[i % n]);
    const double b = chord(points[i % n], points[(i + 1) % n]);
    if (std::max(a, b) > 4 * std::min(a, b))
      refuse(place(i) + " is " + number(a) + " m from the one before it and " + number(b) +
             " m from the next, expected points about equally far apart, within a factor of 4");
  }
}

/// The cubic through the first and last value with the second differences of four values at each
/// end (of three, if there are no more), by the index from the middle.
std::array<Quad, 4> cubic_through(const std::vector<double>& f) {
  const size_t n = f.size() - 1;
  const Quad N = Quad(double(n));
  const auto bend = [&](size_t a, size_t b, size_t c, size_t d) {
    return Quad(2) * Quad(f[a]) - Quad(5) * Quad(f[b]) + Quad(4) * Quad(f[c]) - Quad(f[d]);
  };
  Quad first(0), last(0);
  if (n == 2) first = last = Quad(f[0]) - Quad(2) * Quad(f[1]) + Quad(f[2]);
  if (n > 2) {
    first = bend(0, 1, 2, 3);
    last = bend(n, n - 1, n - 2, n - 3);
  }
  const Quad half = N / Quad(2), sum = first + last;
  return {(Quad(f[0]) + Quad(f[n])) / Quad(2) - half * half * sum / Quad(4),
          (Quad(f[n]) - Quad(f[0])) / N - N * (last - first) / Quad(24), sum / Quad(4),
          (last - first) / (Quad(6) * N)};
}

bool segments_cross(double ax, double ay, double bx, double by, double cx, double cy, double dx,
                    double dy) {
  const auto side = [](double px, double py, double qx, double qy, double x, double y) {
    return (qx - px) * (y - py) - (qy - py) * (x - px);
  };
  return side(ax, ay, bx, by, cx, cy) * side(ax, ay, bx, by, dx, dy) < 0 &&
         side(cx, cy, dx, dy, ax, ay) * side(cx, cy, dx, dy, bx, by) < 0;
}

}  // namespace

/// In 113 bits, rounded once.
PlaneCurve::Coordinate PlaneCurve::through(const std::vector<double>& f, bool closed) {
  const size_t n = f.size(), half = closed ? n : n - 1;  // π (closed: 2π) in so many steps
  const Quad two_pi = Quad(phs::two_pi_hi) + Quad(phs::two_pi_lo);
  const Quad step = (closed ? two_pi : two_pi / Quad(2)) / Quad(double(half));
  std::vector<Quad> sine(2 * half), cosine(2 * half), rest(f.begin(), f.end());
  for (size_t i = 0; i < 2 * half; ++i) phs::sincos(step * Quad(double(i)), sine[i], cosine[i]);
  Coordinate out;
  if (!closed) {
    const auto p = cubic_through(f);
    for (size_t j = 0; j < n; ++j) {
      const Quad t = Quad(double(j)) - Quad(double(half)) / Quad(2);
      rest[j] -= p[0] + t * (p[1] + t * (p[2] + t * p[3]));
    }
    Quad scale(1);
    for (size_t k = 0; k < 4; ++k) {
      out.p[k] = double(p[k] * scale);
      scale /= step;
    }
  }
  const size_t most = closed ? n / 2 : n - 2;
  for (size_t k = 1; k <= most; ++k) {
    Quad c(0), s(0);
    for (size_t j = 0; j < n; ++j) {
      c += rest[j] * cosine[j * k % (2 * half)];
      s += rest[j] * sine[j * k % (2 * half)];
    }
    const Quad scale = Quad(closed && 2 * k == n ? 1 : 2) / Quad(double(half));
    out.c.push_back(closed ? double(c * scale) : 0);
    out.s.push_back(closed && 2 * k == n ? 0 : double(s * scale));
  }
  if (closed) {
    Quad sum(0);
    for (const Quad v : rest) sum += v;
    out.p[0] = double(sum / Quad(double(n)));
  }
  return out;
}

/// The last harmonics of a smooth curve are roundings of its points.
void PlaneCurve::leave_out_roundings(double size) {
  const auto small = [&](double c) { return std::fabs(c) < 0x1p-53 * size; };
  while (!x_.c.empty() && small(x_.c.back()) && small(x_.s.back()) && small(y_.c.back()) &&
         small(y_.s.back()))
    for (auto* all : {&x_.c, &x_.s, &y_.c, &y_.s}) all->pop_back();
}

PlaneCurve::PlaneCurve(const std::vector<Point>& points, bool closed, const std::string& what)
    : closed_(closed) {
  check_points(points, closed, what);
  const size_t n = points.size();
  std::vector<double> x, y;
  double size = 0;
  for (const Point& p : points) {
    x.push_back(p[0]);
    y.push_back(p[1]);
    size = std::max(size, chord(points[0], p));
  }
  x_ = through(x, closed);
  y_ = through(y, closed);
  leave_out_roundings(size);
  const size_t steps = closed ? n : n - 1;
  last_ = closed ? 2 * phs::pi_hi : phs::pi_hi;
  step_ = last_ / double(steps);
  for (size_t i = 0; i < parts_of_a_step * steps + !closed; ++i) {
    const Place<double> c = at(double(i) * step_ / parts_of_a_step);
    samples_.push_back({c.x, c.y});
  }
  check_shape(points, what);
}

void PlaneCurve::check_shape(const std::vector<Point>& points, const std::string& what) const {
  const size_t n = points.size(), m = samples_.size(), segments = closed_ ? m : m - 1;
  const auto after = [](size_t i) {
    return "after point " + std::to_string(i / parts_of_a_step + 1);
  };
  for (size_t i = 0; i < segments; ++i) {
    const Place<double> c = at(double(i) * step_ / parts_of_a_step);
    const size_t j = i / parts_of_a_step;
    if (std::hypot(c.vx, c.vy) * step_ < 0.05 * chord(points[j], points[(j + 1) % n]))
      throw InvalidArgument(what + ": the curve has a cusp at or " + after(i) +
                            ", expected one that turns smoothly");
  }
  for (size_t i = 0; i < segments; ++i) {
    const Sample &a = samples_[i], &b = samples_[i + 1 == m ? 0 : i + 1];
    for (size_t j = i + 2; j < segments; ++j) {
      const Sample &c = samples_[j], &d = samples_[j + 1 == m ? 0 : j + 1];
      if (segments_cross(a.x, a.y, b.x, b.y, c.x, c.y, d.x, d.y))
        throw InvalidArgument(what + ": the curve crosses itself, " + after(i) + " and " +
                              after(j) + ", expected one that does not");
    }
  }
}

double PlaneCurve::nearest(double x, double y) const {
  const double spacing = step_ / parts_of_a_step;
  size_t best = 0;
  double least = HUGE_VAL;
  for (size_t i = 0; i < samples_.size(); ++i) {
    const double dx = samples_[i].x - x, dy = samples_[i].y - y, away = dx * dx + dy * dy;
    if (away < least) {
      least = away;
      best = i;
    }
  }
  double s = double(best) * spacing;
  if (!std::isfinite(x) || !std::isfinite(y)) return s;
  for (int i = 0; i < 60; ++i) {
    const Place<double> c = at(s);
    const double dx = c.x - x, dy = c.y - y, v2 = c.vx * c.vx + c.vy * c.vy;
    const double slope = std::max(v2 + (dx * c.ax + dy * c.ay), 0.1 * v2);
    const double step = std::clamp((dx * c.vx + dy * c.vy) / slope, -spacing, spacing);
    s -= step;
    if (std::fabs(step) <= 1e-9 * spacing || ends_before(s)) break;  // the next is its square
  }
  return s;
}

}  // namespace porthos::mechanics
