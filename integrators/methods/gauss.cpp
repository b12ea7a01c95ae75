#include "integrators/methods/gauss.h"

#include "integrators/core/entry.h"
#include "integrators/methods/collocation.h"
#include "integrators/methods/lane_collocation.h"

namespace porthos::integrators {

Entries gauss_entries() {
  const auto gauss = [](std::string name, std::string title, int s) {
    constexpr auto holds = Claim::holds;
    return with_lanes(
        entry({.name = std::move(name),
               .title = std::move(title),
               .family = "Gauss collocation",
               .order = 2 * s,
               .symmetric = holds,
               .symplectic = holds,
               .quadratic_invariants = holds,
               .source = "Hairer, Lubich, Wanner 2006, II.1.3; Antonana, Makazaga, Murua 2017 "
                         "(round-off)"},
              [s](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
                return make_collocation(d, gauss_table<TableReal<decltype(h)>>(s), m, h, o);
              }),
        [s](const Declaration&, const phs::Model& m, double h, const Options& o) {
          return make_lane_collocation(gauss_table<double>(s), m, h, o);
        });
  };
  Entries e;
  for (int s = 8; s >= 1; --s)
    e.push_back(gauss("gauss" + std::to_string(2 * s),
                      "Gauss collocation, " + std::to_string(s) + (s == 1 ? " stage" : " stages"),
                      s));
  e.push_back(gauss("midpoint", "implicit midpoint rule", 1));
  return e;
}

}  // namespace porthos::integrators
