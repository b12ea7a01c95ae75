#pragma once
#include <span>
#include <vector>

#include "mechanics/hamiltonian_field.h"

namespace porthos::scene {

/// What resists a coordinate of one number where no other is pushed: 1 / (M⁻¹)_cc [kg m² | kg].
/// @param q  the mechanism's coordinates (nq), whose turns the workspace has. Cost: O(n)
inline double lone_inertia(const mechanics::Mechanism& m, mechanics::Workspace<double>& w,
                           std::span<const double> q, const mechanics::JointCoordinates& c) {
  std::vector<double> unit(q.size());
  unit[size_t(c.q)] = 1;
  mechanics::rates_from_momenta<double>(m, w, q, unit);
  return 1 / w.rate[size_t(c.v)];
}

}  // namespace porthos::scene
