#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// SUNDIALS solvers on the same flat state, as independent rivals: CVODE (Adams, BDF), ARKODE
/// (explicit orders 4, 5, 8, implicit order 5) and IDA on y' - f(t, y) = 0. They work to
/// Options::rtol and atol. A "step" of length h is as many inner steps as they choose, stopped
/// exactly at its end. Angles are not wrapped and low words stay zero.
std::vector<Entry> sundials_entries();

}  // namespace porthos::integrators
