#pragma once
#include <span>

#include "phs/system/description.h"

namespace porthos::test {

/// A mass of 1 kg in a well, H = p²/2 + q⁴/4, of a system that is driven and loses energy.
struct QuarticWell {
  static phs::Description of(const char* name) {
    phs::Description d;
    d.name = name;
    d.nx = 2;
    d.traits.canonical = true;
    d.traits.autonomous = d.traits.lossless = false;
    d.blocks = {{"q", phs::BlockKind::linear, 0, 1, 1, "m", "kg m/s"}};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * x[1] * x[1] + T(0.25) * x[0] * x[0] * x[0] * x[0];
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = x[0] * x[0] * x[0];
    e[1] = x[1];
  }
};

}  // namespace porthos::test
