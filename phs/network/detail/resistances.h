#pragma once
#include <algorithm>
#include <span>
#include <vector>

#include "phs/network/detail/network_plan.h"

/// Resistive laws of a network: u -= D(y) y with D diagonal and >= 0.
namespace porthos::phs {

/// D of a bristle at the rate v of its port and the force e = σ0 z that it stores:
///   v: σ1 (1 - sgn(v) e / g(v)) + σ2,   e: |v| / g(v)
/// so z' = v - |v| e / g and the port feels -(e + σ1 z' + σ2 v). The second is never negative, and
/// the first is not where σ1 (1 - F_s / F_c) + σ2 >= 0 and |e| <= F_s. That stays true along every
/// motion, because |e|' <= σ0 |v| (1 - F_s / g) <= 0 at |e| = F_s. Beyond it the first has ±F_s for
/// e, so R(x) >= 0 in all states.
///
/// At v = 0 both forces D y are continuous with a kink. There sgn(0) = 0, so a dual number has the
/// mean of their slopes on the two sides.
template <class T>
struct BristleResistance {
  T rate, slip;
};
template <class T>
BristleResistance<T> bristle_resistance(const LuGre& f, const T& v, const T& e) {
  T g(f.coulomb);
  if (f.breakaway > f.coulomb) {
    const T s = v / T(f.stribeck);
    g = g + T(f.breakaway - f.coulomb) * exp(-(s * s));
  }
  const T sign = select(v < T(0.0), T(-1.0), select(v > T(0.0), T(1.0), T(0.0)));
  const T most(std::max(f.breakaway, f.coulomb)), bent = max(-most, min(e, most));
  return {T(f.bristle_damping) * (T(1.0) - sign * bent / g) + T(f.viscous), sign * v / g};
}

/// v -= D y.
template <class T>
void add_resistances(const Network::Plan& p, const std::vector<T>& y, std::vector<T>& v) {
  for (const auto& l : p.laws) {
    const auto at = size_t(l.row);
    v[at] = v[at] - (*l.law)(y[at]);
  }
  for (const auto& b : p.bristles) {
    const auto rate = size_t(b.rate), force = size_t(b.force);
    const auto D = bristle_resistance(b.law, y[rate], y[force]);
    v[rate] = v[rate] - D.rate * y[rate];
    v[force] = v[force] - D.slip * y[force];
  }
}

/// The diagonal of D at y, written to D; a law is there as its secant.
template <class T>
void find_secants(const Network::Plan& p, const std::vector<T>& y, std::vector<T>& D) {
  std::fill(D.begin(), D.end(), T(0.0));
  for (const auto& l : p.laws) {
    const auto at = size_t(l.row);
    const T tiny(1e-30), away = select(abs(y[at]) < tiny, tiny, y[at]);
    D[at] = D[at] + (*l.law)(away) / away;
  }
  for (const auto& b : p.bristles) {
    const auto rate = size_t(b.rate), force = size_t(b.force);
    const auto own = bristle_resistance(b.law, y[rate], y[force]);
    D[rate] = D[rate] + own.rate;
    D[force] = D[force] + own.slip;
  }
}

/// yᵀD y of each law, then of each bristle, from place k on. @return the place after them
template <class T>
size_t resistive_powers(const Network::Plan& p, const std::vector<T>& y, std::span<T> values,
                        size_t k) {
  for (const auto& l : p.laws) values[k++] = y[size_t(l.row)] * (*l.law)(y[size_t(l.row)]);
  for (const auto& b : p.bristles) {
    const T &v = y[size_t(b.rate)], &e = y[size_t(b.force)];
    const auto D = bristle_resistance(b.law, v, e);
    values[k++] = D.rate * v * v + D.slip * e * e;
  }
  return k;
}

}  // namespace porthos::phs
