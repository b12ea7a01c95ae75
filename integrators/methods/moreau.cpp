#include "integrators/methods/moreau.h"

#include "integrators/core/entry.h"

namespace porthos::integrators {

Entries moreau_entries() {
  return {double_entry({.name = "moreau",
                        .title = "Moreau-Jean time stepping: many rigid contacts with friction",
                        .family = "Time stepping, for rigid contacts",
                        .order = 1,
                        .energy_exact = Claim::holds,
                        .passivity_exact = Claim::holds,
                        .needs = {.contacts = true},
                        .source = "Moreau 1988; Jean 1999, CMAME 177:235; Acary, arXiv:1410.2499"},
                       nullptr)};
}

}  // namespace porthos::integrators
