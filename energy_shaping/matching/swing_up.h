#pragma once
#include <cmath>
#include <string>

#include "phs/error.h"

namespace porthos::energy_shaping {

/// Swing-up of a pendulum by its energy (Åström, Furuta 2000): u = -k q' (E - E_d) + b q', E = ½ I
/// q'² - mgl cos q with q = 0 hanging. Along it d/dt ½ (E - E_d)² = -k q'² (E - E_d)². The viscous
/// friction b is cancelled, dry friction is not.
///
/// At exact rest at the bottom u = 0 for ever: no law of the energy alone can leave this state.
/// `stuck` detects it. With a `kick` the law pushes by that amount as long as |q| and |q'| are
/// below `still`.
struct EnergySwingUp {
  double inertia = 1;       ///< I [kg m²]
  double mgl = 1;           ///< [N m]
  double gain = 1;          ///< k
  double friction = 0;      ///< b [N m s/rad]
  double limit = HUGE_VAL;  ///< |u| at most [N m]
  double kick = 0;          ///< [N m]
  double still = 0.05;      ///< [rad], [rad/s]

  double energy(double q, double rate) const {
    return 0.5 * inertia * rate * rate - mgl * std::cos(q);
  }
  double target() const { return mgl; }
  /// Whether the law without a kick does nothing although the energy is not yet reached.
  bool stuck(double q, double rate) const {
    return rate == 0 && std::sin(q) == 0 && std::cos(q) > 0;
  }
  double operator()(double q, double rate) const {
    const double turned = std::remainder(q, 2 * std::acos(-1.0));
    double u = -gain * rate * (energy(q, rate) - target()) + friction * rate;
    if (kick != 0 && std::fabs(turned) < still && std::fabs(rate) < still) u = kick;
    return std::fmax(-limit, std::fmin(limit, u));
  }
  /// @throws InvalidArgument at a start this law cannot leave
  void check_start(double q, double rate) const {
    if (kick == 0 && stuck(q, rate))
      throw InvalidArgument(
          "energy swing-up from exact rest at the bottom is stuck: u = 0 there for ever; start off "
          "it or give a kick");
  }
};

}  // namespace porthos::energy_shaping
