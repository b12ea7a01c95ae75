// Families whose shape is a table: cams and profiles.
#include "vsa/detail/curve.h"
#include "vsa/elastic-inl.h"
#include "vsa/families.h"

namespace porthos::vsa {
namespace {

/// ½ κ (l(φ) + r μ)²
struct ProfileEnergy {
  double kappa, drum;
  Curve length;
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T d = length(phi) + T(drum) * sigma;
    return T(0.5 * kappa) * d * d;
  }
};

struct FloatingSpringEnergy {
  double kappa, x0;
  Curve rise;
  template <class T>
  T energy(const T& phi, const T& sigma) const {
    const T d = rise(T(phi + sigma)) + rise(T(sigma - phi)) + T(x0);
    return T(0.5 * kappa) * d * d;
  }
};

}  // namespace

ElasticPtr maccepa_profile(const MaccepaProfile& p, const Limits& l) {
  const char* const name = "maccepa_profile";
  require(p.kappa > 0, name, "kappa", p.kappa, "more than 0 N/m");
  require(p.drum > 0, name, "drum", p.drum, "more than 0 m");
  return make_elastic(
      ProfileEnergy{p.kappa, p.drum, Curve(p.angle, p.length, "maccepa_profile, length")},
      {.family = name,
       .title = "MACCEPA 2.0, cable on a profile",
       .sigma = "angle of the pretension drum",
       .sigma_unit = "rad",
       .limits = l});
}

ElasticPtr floating_spring_cam(const FloatingSpringCam& p, const Limits& l) {
  const char* const name = "floating_spring_cam";
  require(p.kappa > 0, name, "kappa", p.kappa, "more than 0 N/m");
  require(true, name, "x0", p.x0, "a finite number");
  return make_elastic(
      FloatingSpringEnergy{p.kappa, p.x0, Curve(p.angle, p.rise, "floating_spring_cam, rise")},
      {.family = name,
       .title = "Floating spring between two cams (FSJ)",
       .sigma = "angle between the cams, half",
       .sigma_unit = "rad",
       .limits = l});
}

ElasticPtr preload_cam(const PreloadCam& p, const Limits& l) {
  const char* const name = "preload_cam";
  require(p.kappa > 0, name, "kappa", p.kappa, "more than 0 N/m");
  return make_elastic(ProfileEnergy{p.kappa, 1.0, Curve(p.angle, p.rise, "preload_cam, rise")},
                      {.family = name,
                       .title = "Roller on a cam, spring preloaded (VS-Joint)",
                       .sigma = "preload of the spring",
                       .sigma_unit = "m",
                       .limits = l});
}

}  // namespace porthos::vsa
