#pragma once
#include <array>
#include <cmath>
#include <string>
#include <type_traits>
#include <vector>

#include "phs/scalars/scalar.h"
#include "phs/scalars/trig.h"
#include "phs/system/state.h"

namespace porthos::mechanics {

/// A smooth curve in a plane through points, which are met at equal steps of its parameter.
///
/// A closed one is the trigonometric interpolation of both coordinates. An open one is a cubic with
/// the bends that four points at each end have, and a series of sines through what remains. So both
/// are analytic: no derivative of any order jumps, and methods keep their order. Circles and
/// ellipses through points at equal steps of their angle are met to rounding, and so are cubics
/// through points at equal steps of x. An evaluation costs O(n) for n points.
///
/// The signed distance of a place needs no parameter of the curve among the unknowns: the nearest
/// point is found by Newton's method, from the nearest of samples to rounding, and then in the
/// scalar T, so that the derivatives of duals are exact.
/// Source: trigonometric interpolation and series of sines: Lanczos 1956, Applied Analysis, IV.
class PlaneCurve {
 public:
  using Point = std::array<double, 2>;
  template <class T>
  struct Distance {
    T value;   ///< positive to the left of the curve [m]; NaN beyond an end by more than one step
    T nx, ny;  ///< its gradient, the unit normal
  };

  /// points: [m], about equally far apart; closed: the last is joined to the first
  /// @throws InvalidArgument that begins with `what`: fewer than two points (closed: three), one
  ///   that is not finite, two neighbours at one place, distances between neighbours that change by
  ///   more than a factor of four, a cusp, a curve that crosses itself
  PlaneCurve(const std::vector<Point>& points, bool closed, const std::string& what);

  /// The distance of the place (x, y) [m] from the curve.
  template <class T>
  Distance<T> distance(const T& x, const T& y) const {
    if constexpr (phs::is_pack<T>) {
      Distance<T> all{x, x, x};
      for (int k = 0; k < phs::lanes<T>; ++k) {
        const auto one = distance(x[k], y[k]);
        all.value.set(k, one.value);
        all.nx.set(k, one.nx);
        all.ny.set(k, one.ny);
      }
      return all;
    } else if constexpr (std::is_same_v<T, double>) {
      // In more bits, rounded once: in double the normal's roundings did work of one sign along a
      // curve that is followed round and round, 4e-18 J a step (OnCurve.KeepsEnergyAndTheCurve).
      const auto d = distance<long double>(x, y);
      return {double(d.value), double(d.nx), double(d.ny)};
    } else {
      const double near = nearest(phs::to_double(x), phs::to_double(y));
      T s(near);
      constexpr int more = std::is_same_v<T, long double> ? 1 : 3;  // a dual needs two
      for (int i = 0; i < more; ++i) {
        const Place<T> c = at(s);
        const T dx = c.x - x, dy = c.y - y;
        s = s - (dx * c.vx + dy * c.vy) / ((c.vx * c.vx + c.vy * c.vy) + (dx * c.ax + dy * c.ay));
      }
      const Place<T> c = at(s);
      const T scale = T(1.0) / phs::sqrt(c.vx * c.vx + c.vy * c.vy);
      const T nx = -(c.vy * scale), ny = c.vx * scale;
      const T d = nx * (x - c.x) + ny * (y - c.y);
      return {ends_before(near) ? d * T(NAN) : d, nx, ny};
    }
  }

 private:
  /// A point of the curve and its derivatives by the parameter.
  template <class T>
  struct Place {
    T x, vx, ax, y, vy, ay;
  };
  /// Σ p_k (s - π/2)^k + Σ (c_k cos ks + s_k sin ks), the second sum from k = 1.
  struct Coordinate {
    std::array<double, 4> p{};
    std::vector<double> c, s;
  };
  struct Sample {
    double x, y;
  };
  static constexpr double middle = phs::pi_hi / 2;
  static Coordinate through(const std::vector<double>& values, bool closed);
  void leave_out_roundings(double size);
  void check_shape(const std::vector<Point>& points, const std::string& what) const;
  bool ends_before(double s) const { return !closed_ && (s < -step_ || s > last_ + step_); }

  /// Powers of e^{is} by products; rounding grows with k, the harmonics fall with it.
  template <class T>
  Place<T> at(const T& s) const {
    Place<T> out{};
    const T u = s - T(middle);
    polynomial(x_.p, u, out.x, out.vx, out.ax);
    polynomial(y_.p, u, out.y, out.vy, out.ay);
    if (x_.c.empty()) return out;
    T sine, cosine;
    phs::sincos(s, sine, cosine);
    T c = cosine, z = sine;
    for (size_t i = 0; i < x_.c.size(); ++i) {
      const T k{double(i + 1)};
      const T x = T(x_.c[i]) * c + T(x_.s[i]) * z, y = T(y_.c[i]) * c + T(y_.s[i]) * z;
      out.x = out.x + x;
      out.y = out.y + y;
      out.vx = out.vx + k * (T(x_.s[i]) * c - T(x_.c[i]) * z);
      out.vy = out.vy + k * (T(y_.s[i]) * c - T(y_.c[i]) * z);
      out.ax = out.ax - (k * k) * x;
      out.ay = out.ay - (k * k) * y;
      const T next = c * cosine - z * sine;
      z = z * cosine + c * sine;
      c = next;
    }
    return out;
  }
  template <class T>
  static void polynomial(const std::array<double, 4>& p, const T& u, T& value, T& slope, T& bend) {
    value = T(p[0]) + u * (T(p[1]) + u * (T(p[2]) + u * T(p[3])));
    slope = T(p[1]) + u * (T(2 * p[2]) + u * T(3 * p[3]));
    bend = T(2 * p[2]) + u * T(6 * p[3]);
  }
  /// The parameter of the point nearest to (x, y), to rounding.
  double nearest(double x, double y) const;

  Coordinate x_, y_;
  bool closed_;
  double step_;  ///< of the parameter between points
  double last_;  ///< parameter of the end, or of the start after one turn
  std::vector<Sample> samples_;
};

}  // namespace porthos::mechanics
