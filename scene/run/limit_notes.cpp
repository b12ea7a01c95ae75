#include "scene/run/limit_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace porthos::scene {

std::vector<std::string> notes_on_limits(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when,
                                         const std::vector<std::string>& held) {
  std::string list;
  int count = 0;
  for (const auto& j : model.mechanism().joint_properties()) {
    if (std::find(held.begin(), held.end(), j.joint) != held.end()) continue;
    double z = state.x[size_t(j.q)];
    if (j.turn >= 0) z += phs::two_pi_hi * double(state.turns[size_t(j.turn)]);
    const bool below = j.lower && z < *j.lower, above = j.upper && z > *j.upper;
    if (!below && !above) continue;
    const char* unit = j.turn >= 0 ? "rad" : "m";
    ++count;
    list += count == 1
                ? fmt::format("joint '{}' is at {:.6g} {} {}, beyond its {} limit of {:.6g} {}",
                              j.joint, z, unit, when, below ? "lower" : "upper",
                              below ? *j.lower : *j.upper, unit)
                : fmt::format(", '{}' at {:.6g} {} ({} {:.6g})", j.joint, z, unit,
                              below ? "lower" : "upper", below ? *j.lower : *j.upper);
  }
  if (count == 0) return {};
  const char* reason =
      ": limits of the model file do not act without an element of type \"limits\" or "
      "\"joint_stop\"";
  return {list + reason};
}

std::vector<std::string> notes_on_speeds(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when) {
  std::string list;
  std::vector<double> v;
  for (const auto& j : model.mechanism().joint_properties()) {
    if (!j.rate || !(*j.rate > 0)) continue;
    if (v.empty())
      v = model.rates(std::span(state.x).first(size_t(model.description().nx)),
                      std::span(state.turns).first(size_t(model.mechanism().angle_count())));
    const double rate = v[size_t(j.v)];
    if (!(std::fabs(rate) > *j.rate)) continue;
    const char* unit = j.turn >= 0 ? "rad/s" : "m/s";
    list += list.empty()
                ? fmt::format("joint '{}' moves at {:.6g} {} {}, faster than its {:.6g} {}",
                              j.joint, rate, unit, when, *j.rate, unit)
                : fmt::format(", '{}' at {:.6g} {} ({:.6g})", j.joint, rate, unit, *j.rate);
  }
  if (list.empty()) return {};
  return {list + ": velocities of the model file's limits do not act"};
}

}  // namespace porthos::scene
