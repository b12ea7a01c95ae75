#pragma once
#include "tests/support/pendulum.h"

namespace porthos::test {

/// The pendulum damped, and driven by a torque that depends on time.
struct DrivenPendulum : Pendulum {
  phs::Description description() const {
    auto d = Pendulum::description();
    d.name = "driven pendulum";
    d.traits.autonomous = d.traits.lossless = false;
    return d;
  }
  template <class T>
  void dissipation(std::span<const T>, std::span<const T> e, std::span<T> Re) const {
    Re[0] = T(0.0);
    Re[1] = T(0.2) * e[1];
  }
  template <class T>
  void drive(T t, std::span<const T>, std::span<T> dx) const {
    dx[1] = dx[1] + T(1.5) * phs::sin(T(0.7) * t);
  }
};

}  // namespace porthos::test
