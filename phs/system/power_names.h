#pragma once
#include <string>

#include "phs/system/description.h"

namespace porthos::phs {

/// Names of the powers by which a system gains or loses energy, for messages: "shoulder.damper,
/// elbow.drive". At most three.
inline std::string power_names(const Description& d, bool losses_only) {
  std::string names;
  int n = 0;
  for (const PowerAccount& a : d.powers) {
    if (a.kind == PowerKind::observed) continue;
    if (losses_only && a.kind != PowerKind::dissipated && !a.control) continue;
    if (++n > 3) return names + " …";
    names += (n > 1 ? ", " : "") + a.name;
  }
  return names;
}

}  // namespace porthos::phs
