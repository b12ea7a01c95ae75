#pragma once
#include "integrators/integrator.h"

namespace porthos::integrators {

struct Entry;

/// SUNDIALS CVODE on the same flat state: the independent rival. Works to Options::rtol and atol; a "step" of length h is
/// as many inner steps as CVODE likes, stopped exactly at its end. Angles are not wrapped and low words stay zero.
std::vector<Entry> cvode_entries();

}  // namespace porthos::integrators
