#pragma once
#include <cmath>
#include <string>

#include "phs/error.h"

namespace porthos::energy_shaping {

/// Swing-up of a pendulum by its energy (Åström, Furuta 2000): u = -k q' (E - E_d) + b q', E = ½ I
/// q'² - mgl cos q with q = 0 hanging. Along it d/dt ½ (E - E_d)² = -k q'² (E - E_d)². The viscous
/// friction b is cancelled, dry friction is not.
///
/// At exact rest at the bottom u = 0 for ever: every law of the energy alone is stuck there.
/// `stuck` says so, and with a `kick` the law pushes by that much as long as |q| and |q'| are below
/// `still`.
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
  /// Whether the law without a kick does nothing although the energy is not there yet.
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

/// A store of energy that pays for what a controller does beyond passivity (after Duindam,
/// Stramigioli 2004; Franken et al. 2011, with T itself as the state, so that nothing is divided by
/// √T). What is asked for is granted as far as the tank has it above `least`; what is dissipated
/// elsewhere fills it up to `most`. Plant plus tank are passive: (H + T)' <= port power.
class EnergyTank {
 public:
  /// @throws InvalidArgument unless 0 <= least < most and least <= level <= most
  EnergyTank(double level, double least, double most, double smooth = 0)
      : level_(level),
        least_(least),
        most_(most),
        smooth_(smooth > 0 ? smooth : 0.1 * (most - least)) {
    if (!(least >= 0 && least < most && level >= least && level <= most))
      throw InvalidArgument("an energy tank needs 0 <= least <= level <= most, has " +
                            std::to_string(least) + ", " + std::to_string(level) + ", " +
                            std::to_string(most));
  }
  double level() const { return level_; }
  /// The share of a power that may be drawn now: 1 well above `least`, smoothly to 0 at it.
  double gate() const {
    const double s = (level_ - least_) / smooth_;
    return s <= 0 ? 0 : s >= 1 ? 1 : s * s * (3 - 2 * s);
  }
  /// Books a step: `dissipated` >= 0 may be stored, `drawn` was used (negative: given back) [J].
  /// Returns the energy that did not fit and is lost as heat. @throws InvalidArgument if more is
  /// drawn than there is above `least`
  double step(double dissipated, double drawn) {
    if (!(dissipated >= 0))
      throw InvalidArgument("an energy tank is filled by what is dissipated, not by " +
                            std::to_string(dissipated));
    double next = level_ + dissipated - drawn;
    const double rounding = 1e-15 * (level_ + dissipated + std::fabs(drawn));
    if (next < least_ && next >= least_ - rounding) next = least_;  // all of available() was drawn
    if (next < least_)
      throw InvalidArgument("an energy tank at " + std::to_string(level_) + " J cannot give " +
                            std::to_string(drawn) + " J and keep " + std::to_string(least_));
    level_ = std::fmin(next, most_);
    return next - level_;
  }
  /// The most that step() can give besides `dissipated`.
  double available(double dissipated = 0) const { return level_ + dissipated - least_; }

 private:
  double level_, least_, most_, smooth_;
};

}  // namespace porthos::energy_shaping
