#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// The classical Runge-Kutta method, order 4: a baseline that conserves nothing.
std::vector<Entry> rk4_entries();

}  // namespace porthos::integrators
