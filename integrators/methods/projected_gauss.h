#pragma once
#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Gauss collocation with the rates on the constraints at every stage, brought back to the manifold
/// at the end of each step, for constraints that roll too: pgauss2 … pgauss16.
Entries projected_gauss_entries();

}  // namespace porthos::integrators
