#include "integrators/methods/hbvm.h"

#include "integrators/core/entry.h"
#include "integrators/methods/collocation.h"
#include "integrators/methods/lane_collocation.h"

namespace porthos::integrators {

Entries hbvm_entries() {
  const auto hbvm = [](std::string name, std::string title, int r, std::string source) {
    return with_lanes(
        entry(
            {.name = std::move(name),
             .title = std::move(title),
             .family = "Energy-preserving",
             .order = 2 * r,
             .symmetric = Claim::holds,
             // exact to the order-32 quadrature: to rounding at steps that resolve the motion, not
             // at every step
             .energy_exact = Claim::fails,
             .needs = {.canonical = true},
             .source = std::move(source)},
            [r](const Declaration& d, const phs::Model& m, auto h, const Options& o) {
              return make_collocation(d, hbvm_table<TableReal<decltype(h)>>(16, r), m, h, o);
            }),
        [r](const Declaration&, const phs::Model& m, double h, const Options& o) {
          return make_lane_collocation(hbvm_table<double>(16, r), m, h, o);
        });
  };
  const char* bit = "Brugnano, Iavernaro, Trigiante 2010, J. Numer. Anal. Ind. Appl. Math. 5:17";
  return {hbvm("hbvm8", "HBVM(16,4): H to the order-32 quadrature", 4, bit),
          hbvm("hbvm6", "HBVM(16,3): H to the order-32 quadrature", 3, bit),
          hbvm("hbvm4", "HBVM(16,2): H to the order-32 quadrature", 2, bit)};
}

}  // namespace porthos::integrators
