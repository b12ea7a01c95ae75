#pragma once
#include <span>

#include "phs/scalars/complex.h"

namespace porthos::phs {

/// The solves of an implicit method's Newton iteration: (I - z J)⁻¹ r for four complex numbers z at
/// once, one per lane, with J = Df(x) or what the system thinks stiff of it. J decides how fast the
/// iteration contracts, never its limit.
///
/// A system that knows a cheap elimination offers it (System::resolvent); others are served by a
/// dense or a Krylov solver of the integrators. Neither function allocates.
class Resolvent {
 public:
  virtual ~Resolvent() = default;
  /// Whether J is all of Df, so that no other solver can contract better.
  virtual bool exact() const { return false; }
  /// Freezes J at (t, x), size nx, for the four z.
  virtual void factor(double t, std::span<const double> x, const Complex4& z) = 0;
  /// r ← (I - z J)⁻¹ r, size nx.
  virtual void solve(std::span<Complex4> r) = 0;
};

}  // namespace porthos::phs
