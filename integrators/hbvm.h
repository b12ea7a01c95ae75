#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Hamiltonian boundary value methods HBVM(8, r), r = 1 … 4, order 2r: H is kept as exactly as eight Gauss nodes
/// integrate its power along the step, that is to rounding at steps that resolve the motion, far beyond what a trajectory
/// of order 2r gives. r = 1 is the average vector field (mean value discrete gradient) with eight nodes.
std::vector<Entry> hbvm_entries();

}  // namespace porthos::integrators
