#pragma once
#include <cmath>

#include "phs/user_model.h"

/// Small systems for splitting methods: separable ones, and one that offers the flows of its parts.
namespace porthos::test {

template <class T>
using In = std::span<const T>;
template <class T>
using Out = std::span<T>;

inline phs::Description plane_description(std::string name) {
  phs::Description d;
  d.name = std::move(name), d.nx = 4, d.traits = {.canonical = true, .separable = true};
  d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "m", "kg m/s"}};
  return d;
}

/// H = |p|²/2 + |q|²/2 + q₁²q₂ - q₂³/3 (Hénon, Heiles 1964).
struct HenonHeiles {
  bool separable = true;  ///< what it says of itself
  phs::Description description() const {
    auto d = plane_description("henon_heiles");
    d.traits.separable = separable;
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    return T(0.5) * (x[2] * x[2] + x[3] * x[3] + x[0] * x[0] + x[1] * x[1]) + x[0] * x[0] * x[1] -
           x[1] * x[1] * x[1] / T(3.0);
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    e[0] = x[0] + T(2.0) * x[0] * x[1], e[1] = x[1] + x[0] * x[0] - x[1] * x[1];
    e[2] = x[2], e[3] = x[3];
  }
};

/// H = |p|²/2 - 1/|q|.
struct Kepler {
  phs::Description description() const {
    auto d = plane_description("kepler");
    d.invariants = {{"angular_momentum", 1, 0, 2, "kg m²/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(In<T> x) const {
    using phs::sqrt;
    return T(0.5) * (x[2] * x[2] + x[3] * x[3]) - T(1.0) / sqrt(x[0] * x[0] + x[1] * x[1]);
  }
  template <class T>
  void gradient(In<T> x, Out<T> e) const {
    using phs::sqrt;
    const T r2 = x[0] * x[0] + x[1] * x[1], k = T(1.0) / (r2 * sqrt(r2));
    e[0] = k * x[0], e[1] = k * x[1], e[2] = x[2], e[3] = x[3];
  }
  template <class T>
  void invariants(In<T> x, Out<T> values) const {
    values[0] = x[0] * x[3] - x[1] * x[2];
  }
};

/// A pendulum going round: H = p²/2 - cos q, with a torque cos 3t if driven.
struct Rotor {
  bool driven = false;
  phs::Description description() const {
    phs::Description d;
    d.name = "rotor", d.nx = 2;
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
    e[0] = s, e[1] = x[1];
  }
  template <class T>
  void drive(T t, In<T>, Out<T> dx) const {
    T s, c;
    phs::sincos(T(3.0) * t, s, c);
    if (driven) dx[1] += c;
  }
};

/// A free rigid body, x = its momentum m in body axes: J(m) e = m × e, H = Σ m_k²/(2 I_k) in three parts, each of which
/// turns m about one axis (McLachlan 1993; Reich 1994).
struct FreeBody {
  static constexpr double inertia[] = {1, 2, 3};
  phs::Description description() const {
    phs::Description d;
    d.name = "free_body", d.nx = 3;
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
    x[c] = cos * x[c] - sin * x[b], x[b] = xb;
  }
};

}  // namespace porthos::test
