#pragma once
#include <vector>

namespace porthos::integrators {

struct Entry;

/// Time stepping for rigid contacts. The entry has the claims; contact::with_time_stepping() makes
/// the method, since it needs the contacts and not their system alone.
std::vector<Entry> moreau_entries();

}  // namespace porthos::integrators
