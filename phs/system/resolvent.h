#pragma once
#include <span>

#include "phs/scalars/complex.h"

namespace porthos::phs {

/// The linear solves of an implicit method's Newton iteration: (I - z J)⁻¹ r for four complex
/// numbers z at once, one per lane. J is Df(x) or its stiff part, as the system chooses. J affects
/// how fast the iteration contracts, never its limit.
///
/// A system with a cheap elimination offers it (System::resolvent). For the others the integrators
/// have dense and Krylov solvers. Neither function allocates.
class Resolvent {
 public:
  virtual ~Resolvent() = default;
  /// Whether J is the whole Df, so that no other solver can contract faster.
  virtual bool exact() const { return false; }
  /// Fixes J at (t, x), x of size nx, for the four z.
  virtual void factor(double t, std::span<const double> x, const Complex4& z) = 0;
  /// r ← (I - z J)⁻¹ r, size nx.
  virtual void solve(std::span<Complex4> r) = 0;
};

}  // namespace porthos::phs
