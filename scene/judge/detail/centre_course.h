#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "scene/assemble/centre_of_mass.h"

namespace porthos::scene {

/// The velocity of the centre of mass beside that of free fall.
class CentreCourse {
 public:
  /// @return its momentum less that of free fall from the first row [N s]
  /// @param t time since the first row [s]
  /// @param linear scale of the linear momentum [N s]
  std::array<double, 3> add(double t, const CentreOfMass& centre, double linear,
                            const CentreOfMass::Vec& gravity, double mass) {
    if (!start_) start_ = centre.start_velocity;
    const auto off = centre.start_velocity - *start_ - CentreOfMass::Real(t) * gravity;
    off_ = std::max(off_, size(off));
    if (t > 0) fall_ = (1 / CentreOfMass::Real(t)) * (centre.start_velocity - *start_);
    fastest_ = std::max({fastest_, size(centre.start_velocity), linear / mass});
    return {mass * double(off.x), mass * double(off.y), mass * double(off.z)};
  }
  /// The largest deviation from free fall, relative to the greatest speed.
  double error() const { return fastest_ > 0 ? off_ / fastest_ : off_; }
  /// The mean acceleration from the first row to the last [m/s²].
  const CentreOfMass::Vec& fall() const { return fall_; }

 private:
  static double size(const CentreOfMass::Vec& v) { return double(std::sqrt(dot(v, v))); }

  std::optional<CentreOfMass::Vec> start_;
  CentreOfMass::Vec fall_{0, 0, 0};
  double off_ = 0, fastest_ = 0;  ///< [m/s]
};

}  // namespace porthos::scene
