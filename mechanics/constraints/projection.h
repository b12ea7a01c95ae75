#pragma once
#include <span>
#include <string>
#include <vector>

#include "mechanics/constraints/constraint_set.h"

/// Starts that fit the constraints.
namespace porthos::mechanics {

/// What close_loops() found and did.
struct ClosedStart {
  double gap = 0;             ///< largest |g| at the start [m | rad]
  double slip = 0;            ///< largest |G v + ∂g/∂t| at the start [m/s | rad/s]
  double moved = 0;           ///< largest change of a coordinate [m | rad]
  double sped_up = 0;         ///< largest change of a joint rate [m/s | rad/s]
  int rank = 0;               ///< independent rows of G at the closed position
  double smallest_pivot = 1;  ///< as phs::Constraints
  std::string largest;        ///< name of the constraint with the largest gap; empty without one
};

/// Moves a start onto the constraints, along M⁻¹Gᵀ: the shortest way in the metric of the kinetic
/// energy. First q to g(q) = 0, by Newton's method, then v to G v = 0, by the plastic impulse.
/// Driven joints get their positions and rates at time 0; bodies that roll are moved without slip.
/// @param q  size nq, changed; quaternions stay normed;  v  size nv, changed
/// @param held  indices in v of joints that stay where they are if the others can close the loops
///   without them; else all move.  held_rates: the same of rates
/// @throws InvalidArgument if the loops cannot be closed from there: it names the constraint whose
///   gap remains largest, its links and the gap
ClosedStart close_loops(const Mechanism& m, const ConstraintSet& set, std::span<double> q,
                        std::span<double> v, std::span<const int> held,
                        std::span<const int> held_rates);
inline ClosedStart close_loops(const Mechanism& m, const ConstraintSet& set, std::span<double> q,
                               std::span<double> v, std::span<const int> held = {}) {
  return close_loops(m, set, q, v, held, held);
}

}  // namespace porthos::mechanics
