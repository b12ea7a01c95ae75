#include "energy_shaping/loop/closed_loop.h"

#include <fmt/format.h>

#include <cmath>

namespace porthos::energy_shaping {

std::vector<int> port_offsets(const phs::Description& plant,
                              const std::vector<std::string>& ports) {
  std::vector<int> at;
  for (const auto& name : ports) {
    std::string known;
    const size_t before = at.size();
    for (const auto& p : plant.ports) {
      if (p.name == name && p.kind == phs::PortKind::effort_in)
        for (int k = 0; k < p.size; ++k) at.push_back(p.at + k);
      add_to_list(known, p.name);
    }
    if (at.size() == before)
      throw InvalidArgument("plant '" + plant.name + "' has no port '" + name +
                            "' that takes an effort; its ports: " + known);
    for (size_t i = before; i < at.size(); ++i)
      for (size_t j = 0; j < before; ++j)
        if (at[i] == at[j])
          throw InvalidArgument("port '" + name + "' is named twice among the actuators of '" +
                                plant.name + "'");
  }
  return at;
}

void refuse_failure(const Certificate& certificate) {
  const CertificateItem* i = certificate.failure();
  if (!i) return;
  const std::string what = remedy(*i);
  const std::string measured =
      fmt::format("{:.4g}, expected {} {:.3g} ({})", unsigned_nan(i->value),
                  std::isnan(i->value) || i->value > i->bound ? "at most" : "at least", i->bound,
                  certificate.about(*i));
  if (i->name == UnheldForce::condition)  // its remedy begins with the joint
    throw InvalidArgument(
        fmt::format("{}: {}; {}: {}", certificate.title(), what, i->name, measured));
  throw InvalidArgument(fmt::format("{}: {} fails: {}{}", certificate.title(), i->name, measured,
                                    what.empty() ? "" : "; " + what));
}

std::vector<std::string> coordinate_names(const phs::Description& plant) {
  std::vector<std::string> names;
  for (const auto& b : plant.blocks)
    for (int k = 0; b.momentum >= 0 && k < b.size; ++k)
      names.push_back(b.size == 1 ? b.name : fmt::format("{}[{}]", b.name, k));
  if (int(names.size()) == plant.nx / 2) return names;
  names.clear();
  for (int k = 0; k < plant.nx / 2; ++k) names.push_back(fmt::format("q[{}]", k));
  return names;
}

}  // namespace porthos::energy_shaping
