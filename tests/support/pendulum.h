#pragma once
#include "phs/system/user_model.h"

namespace porthos::test {

/// The plane pendulum, H = p²/2 - cos q.
struct Pendulum {
  phs::Description description() const {
    phs::Description d;
    d.name = "pendulum";
    d.nx = 2;
    d.blocks = {{"hinge", phs::BlockKind::angle, 0, 1, 1, "rad", "kg m^2/s"}};
    d.traits = {.canonical = true, .separable = true};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] - phs::cos(x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = phs::sin(x[0]);
    e[1] = x[1];
  }
};

}  // namespace porthos::test
