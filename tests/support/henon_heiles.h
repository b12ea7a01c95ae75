#pragma once
#include "phs/system/user_model.h"

namespace porthos::test {

/// Henon & Heiles 1964, separable: H = ½|p|² + ½|q|² + q1² q2 - q2³/3.
struct HenonHeiles {
  bool separable = true;  ///< what it says of itself
  phs::Description description() const {
    phs::Description d;
    d.name = "Henon-Heiles";
    d.nx = 4;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 2, 2, "1", "1"}};
    d.traits = {.canonical = true, .separable = separable};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[2] * x[2] + x[3] * x[3] + x[0] * x[0] + x[1] * x[1]) + x[0] * x[0] * x[1] -
           x[1] * x[1] * x[1] / T(3.0);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0] + T(2.0) * x[0] * x[1];
    e[1] = x[1] + x[0] * x[0] - x[1] * x[1];
    e[2] = x[2];
    e[3] = x[3];
  }
};

}  // namespace porthos::test
