#pragma once
#include <cmath>
#include <vector>

#include "phs/system/user_model.h"

/// The plane Kepler problem, H = |p|²/2 - 1/|q|, semi-major axis 1, period 2π.
namespace porthos::test {

struct Kepler {
  phs::Description description() const {
    phs::Description d;
    d.name = "kepler";
    d.nx = 4;
    d.blocks = {{"x", phs::BlockKind::linear, 0, 1, 2, "m", "kg m/s"},
                {"y", phs::BlockKind::linear, 1, 1, 3, "m", "kg m/s"}};
    d.invariants = {{"angular_momentum", 1, 0, 2, "kg m^2/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    using phs::sqrt;
    return T(0.5) * (x[2] * x[2] + x[3] * x[3]) - T(1.0) / sqrt(x[0] * x[0] + x[1] * x[1]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    using phs::sqrt;
    const T r2 = x[0] * x[0] + x[1] * x[1], w = T(1.0) / (r2 * sqrt(r2));
    e[0] = w * x[0];
    e[1] = w * x[1];
    e[2] = x[2];
    e[3] = x[3];
  }
  template <class T>
  void invariants(std::span<const T> x, std::span<T> v) const {
    v[0] = x[0] * x[3] - x[1] * x[2];
  }
};

/// sigma = |q|^power: 1 turns a Kepler ellipse into a harmonic oscillation, 3/2 gives equal angles
/// about the centre.
template <int twice_power>
struct PowerOfRadius {
  template <class T>
  T value(std::span<const T> x) const {
    using phs::sqrt;
    const T r = sqrt(x[0] * x[0] + x[1] * x[1]);
    if constexpr (twice_power == 2)
      return r;
    else
      return r * sqrt(r);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> g) const {
    using phs::sqrt;
    const T r = sqrt(x[0] * x[0] + x[1] * x[1]);
    const T w = twice_power == 2 ? T(1.0) / r : T(1.5) / sqrt(r);
    g[0] = w * x[0];
    g[1] = w * x[1];
    g[2] = T(0.0);
    g[3] = T(0.0);
  }
};

/// At the pericentre of an ellipse of eccentricity e.
inline std::vector<double> kepler_start(double e) {
  return {1 - e, 0, 0, std::sqrt((1 + e) / (1 - e))};
}

}  // namespace porthos::test
