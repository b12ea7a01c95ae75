#pragma once
#include "phs/user_model.h"

namespace porthos::test {

/// Damped, and driven by a torque that depends on time.
struct DrivenPendulum {
  phs::Description description() const {
    phs::Description d;
    d.name = "driven pendulum", d.nx = 2;
    d.blocks = {{"hinge", phs::BlockKind::angle, 0, 1, 1, "rad", "kg m^2/s"}};
    d.traits = {.autonomous = false, .canonical = true, .separable = true, .lossless = false};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] - cos(x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = sin(x[0]), e[1] = x[1];
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0), Re[1] = T(0.2) * e[1];
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[1] = dx[1] + T(1.5) * sin(T(0.7) * t);
  }
};

}  // namespace porthos::test
