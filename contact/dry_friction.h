#pragma once
#include <string>

#include "phs/scalars/scalar.h"

namespace porthos::contact {

/// Dry friction of a joint with one freedom that sticks exactly. At the rate v the force is
///   -sign(v) F(|v|),  F(s) = coulomb + (breakaway - coulomb) exp(-(s/stribeck)²) + viscous s,
/// and at rest whatever holds the joint, up to `breakaway`. With stribeck = 0 the force falls to
/// `coulomb` where the joint begins to slide.
/// Source: Armstrong-Helouvry, Dupont, Canudas de Wit 1994, Automatica 30, section 2.1.
struct DryFriction {
  std::string name, joint;
  double coulomb = 0;    ///< [N | N m], > 0
  double breakaway = 0;  ///< >= coulomb; 0: coulomb
  double stribeck = 0;   ///< [m/s | rad/s], >= 0
  double viscous = 0;    ///< [N s/m | N m s/rad], >= 0

  /// The largest force that holds the joint [N | N m].
  double holds() const { return breakaway > 0 ? breakaway : coulomb; }
};

/// @throws InvalidArgument naming the number that is out of range
void check(const DryFriction& f);

/// F at a speed of the sign in which the joint slides. It is smooth through 0, where a trial step
/// may go a little too far. Its loss is speed · F.
template <class T>
T sliding_force(const DryFriction& f, const T& speed) {
  using phs::fma;  // of double too, where the machine has none
  T force = fma(T(f.viscous), speed, T(f.coulomb));
  if (f.stribeck > 0 && f.holds() > f.coulomb) {
    const T s = speed / T(f.stribeck);
    force = force + T(f.holds() - f.coulomb) * exp(-(s * s));
  }
  return force;
}

/// The force against the rate v of a joint that slides; 0 at rest.
template <class T>
T friction_at(const DryFriction& f, const T& v) {
  using phs::abs, phs::select;
  const T F = sliding_force(f, T(abs(v)));
  return select(v < T(0.0), T(-F), select(T(0.0) < v, F, T(0.0)));
}

}  // namespace porthos::contact
