#pragma once
#include "contact/impact.h"
#include "phs/scalars/scalar.h"

/// Forces of a contact as functions of its depth δ (positive: the shapes overlap) and rates.
namespace porthos::contact {

using phs::asinh;
using phs::max;
using phs::min;
using phs::select;
using phs::sqrt;

/// How hard a contact pushes, what it loses, and its friction.
///
/// The elastic force f(δ) is the slope of an energy U(δ):
///   power   f = k δ^n while δ > 0, U = k δ^(n+1)/(n+1); n = 1, 2, 3, or 3/2 (Hertz)
///   smooth  f = (k/2) (δ + r), U = (k/4) (δ² + δ r + s² asinh(δ/s)), r = √(δ² + s²): analytic, at
///           most k s/2 above the force of n = 1, and never quite 0
/// The whole normal force is f (1 + a δ')₊ (Hunt, Crossley 1975). The part that is not f is the
/// loss c δ' with c = f min(a, 1/|δ'|) where δ' < 0, so it takes what the shapes give back when
/// they are pulled apart faster than 1/a. Friction on a slip v is μ f (1 + a δ')₊ v / √(v² + v_s²)
/// against it: regularised, so a load at rest creeps.
struct Law {
  /// rigid: no force and no depth, the rates jump at the touch (impact.h)
  enum class Form { power, smooth, rigid } form = Form::smooth;
  double stiffness = 0;                                   ///< k [N/mⁿ], > 0
  double exponent = 1;                                    ///< n of power
  double width = 0;                                       ///< s of smooth [m], > 0
  double loss = 0;                                        ///< a [s/m], >= 0
  double friction = 0;                                    ///< μ, >= 0
  double creep = 0;                                       ///< v_s [m/s], > 0 with friction
  double restitution = 1;                                 ///< e of rigid, 0 to 1
  Simultaneous simultaneous = Simultaneous::reflections;  ///< of rigid
  /// Whether the force or a derivative jumps at δ = 0, where a step must end for the order of a
  /// method.
  bool switches() const { return form != Form::smooth; }
  bool rigid() const { return form == Form::rigid; }
};
/// @throws InvalidArgument naming the number that is out of range
void check(const Law& law);

/// f(δ) [N].
template <class T>
T elastic_force(const Law& law, const T& depth) {
  const T k(law.stiffness);
  if (law.form == Law::Form::smooth) {
    const T s2(law.width * law.width), r = sqrt(depth * depth + s2);
    // δ + r = s²/(r - δ), without its cancellation far outside
    return T(0.5) * k * select(depth < T(0.0), s2 / (r - min(depth, T(0.0))), depth + r);
  }
  const T d = max(depth, T(0.0));
  if (law.exponent == 1) return k * d;
  if (law.exponent == 2) return k * d * d;
  if (law.exponent == 3) return k * d * d * d;
  return k * d * sqrt(select(d > T(0.0), d, T(1.0)));
}
/// U(δ) [J].
template <class T>
T elastic_energy(const Law& law, const T& depth) {
  if (law.form == Law::Form::smooth) {
    const double s = law.width;
    return T(0.5) * depth * elastic_force(law, depth) +
           T(0.25 * law.stiffness * s * s) * asinh(depth / T(s));
  }
  return T(1 / (law.exponent + 1)) * max(depth, T(0.0)) * elastic_force(law, depth);
}
/// c of the loss c δ' [N s/m], from f and δ' [m/s].
template <class T>
T loss_coefficient(const Law& law, const T& force, const T& depth_rate) {
  const T a(law.loss), apart = max(-depth_rate, T(0.0));
  return force * a / max(a * apart, T(1.0));
}
/// c_t of the friction -c_t v [N s/m], from f, δ' and the square of the slip [m²/s²].
template <class T>
T friction_coefficient(const Law& law, const T& force, const T& depth_rate, const T& slip_squared) {
  const T pressed = force * max(T(1.0) + T(law.loss) * depth_rate, T(0.0));
  return T(law.friction) * pressed / sqrt(slip_squared + T(law.creep * law.creep));
}

/// The loss a [s/m] that gives the restitution e to an impact of a free mass at `speed` [m/s], for
/// any k, n and mass. With z = a v: ln(1 - e z) + e z = ln(1 + z) - z (Gonthier and others 2004).
/// @throws InvalidArgument unless 0 < e <= 1 and speed > 0
double loss_for(double restitution, double speed);
/// Time of an elastic contact of a free mass that comes at `speed` [s], with the force k δ^n; of
/// smooth as if n = 1, where it is π √(m/k) at any speed. Infinite where a mass at rest has none.
double contact_time(const Law& law, double mass, double speed);
/// Hertz's k [N/m^1.5] of spheres: (4/3) E √R. @param modulus  E [Pa], 1/E = Σ (1 - ν²)/E_i of both
/// sides; @param curvature  Σ 1/R_i [1/m], a plane 0. @throws InvalidArgument unless both are > 0
double hertz_stiffness(double modulus, double curvature);

}  // namespace porthos::contact
