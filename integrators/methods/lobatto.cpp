#include "integrators/methods/lobatto.h"

#include "integrators/core/entry.h"
#include "integrators/methods/collocation.h"
#include "integrators/methods/lane_collocation.h"

namespace porthos::integrators {

Entries lobatto_entries() {
  Entries e;
  for (int s = 5; s >= 3; --s)
    e.push_back(with_lanes(
        entry({.name = "lobatto" + std::to_string(2 * s - 2),
               .title = "Lobatto IIIA-IIIB pair, " + std::to_string(s) + " stages",
               .family = "Partitioned",
               .order = 2 * s - 2,
               .symmetric = Claim::holds,
               .symplectic = Claim::holds,
               .needs = {.canonical = true, .linear_state = true},
               .source = "Hairer, Lubich, Wanner 2006, II.2.2 and VI.4.2"},
              [s](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
                return make_collocation(d, lobatto_table<TableReal<decltype(h)>>(s), m, h, o);
              }),
        [s](const Declaration&, const phs::Model& m, double h, const Options& o) {
          return make_lane_collocation(lobatto_table<double>(s), m, h, o);
        }));
  return e;
}

}  // namespace porthos::integrators
