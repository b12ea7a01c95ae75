#pragma once
#include "integrators/core/integrator.h"

namespace porthos::integrators {

struct Entry;

/// Gauss collocation with s = 1 … 8 stages, order 2s: symplectic, symmetric, conserves quadratic
/// invariants.
std::vector<Entry> gauss_entries();

}  // namespace porthos::integrators
