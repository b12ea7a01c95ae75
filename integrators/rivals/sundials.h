#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// SUNDIALS solvers on the same flat state, as independent rivals: CVODE (Adams, BDF), ARKODE
/// (explicit orders 4, 5, 8, implicit order 5) and IDA on y' - f(t, y) = 0; on constrained systems
/// CVODE after elimination of the multipliers, and ida_ggl_entry(). They work to
/// Options::rtol and atol. A "step" of length h is as many inner steps as they choose, stopped
/// exactly at its end. Angles are not wrapped and low words stay zero.
std::vector<Entry> sundials_entries();

/// IDA on constrained systems in the index-2 form of Gear, Gupta and Leimkuhler.
Entry ida_ggl_entry();

}  // namespace porthos::integrators
