#pragma once
#include <cmath>

#include "phs/system/user_model.h"
#include "tests/support/henon_heiles.h"
#include "tests/support/kepler.h"

/// Small systems for splitting methods: separable ones, and one that offers the flows of its parts.
namespace porthos::test {

template <class T>
using In = std::span<const T>;
template <class T>
using Out = std::span<T>;

/// A pendulum going round: H = p²/2 - cos q, with a torque cos 3t if driven.
struct Rotor {
  bool driven = false;
  phs::Description description() const {
    phs::Description d;
    d.name = "rotor";
    d.nx = 2;
    d.traits = {.autonomous = !driven, .canonical = true, .separable = true};
    d.blocks = {{"q", phs::BlockKind::angle, 0, 1, 1, "rad", "kg m²/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    T s, c;
    phs::sincos(x[0], s, c);
    return T(0.5) * x[1] * x[1] - c;
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    T s, c;
    phs::sincos(x[0], s, c);
    e[0] = s;
    e[1] = x[1];
  }
  template <class T>
  void drive(T t, In<T>, Out<T> dx) const {
    T s, c;
    phs::sincos(T(3.0) * t, s, c);
    if (driven) dx[1] += c;
  }
};

/// A free rigid body, x = its momentum m in body axes: J(m) e = m × e, H = Σ m_k²/(2 I_k) in three
/// parts, each of which turns m about one axis (McLachlan 1993; Reich 1994).
struct FreeBody {
  static constexpr double inertia[] = {1, 2, 3};
  phs::Description description() const {
    phs::Description d;
    d.name = "free_body";
    d.nx = 3;
    d.blocks = {{"m", phs::BlockKind::linear, 0, 3, -1, "kg m²/s", ""}};
    d.invariants = {{"momentum_squared", 1, 0, 2, "kg² m⁴/s²"}};
    d.flows = {{"about_x"}, {"about_y"}, {"about_z"}};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    T H(0.0);
    for (size_t k = 0; k < 3; ++k) H = H + x[k] * x[k] / T(2 * inertia[k]);
    return H;
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    for (size_t k = 0; k < 3; ++k) e[k] = x[k] / T(inertia[k]);
  }
  template <class T>
  void structure(In<T> m, In<T> e, Out<T> Je) const {
    for (size_t k = 0; k < 3; ++k)
      Je[k] = m[(k + 1) % 3] * e[(k + 2) % 3] - m[(k + 2) % 3] * e[(k + 1) % 3];
  }
  template <class T>
  void invariants(In<T> x, Out<T> values) const {
    values[0] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
  }
  template <class T>
  void flow(int k, T, T h, Out<T> x) const {
    const size_t a = size_t(k), b = (a + 1) % 3, c = (a + 2) % 3;
    T sin, cos;
    phs::sincos(h * x[a] / T(inertia[a]), sin, cos);
    const T xb = cos * x[b] + sin * x[c];
    x[c] = cos * x[c] - sin * x[b];
    x[b] = xb;
  }
};

}  // namespace porthos::test
