#include "scene/run/limit_notes.h"

#include <fmt/format.h>

#include <cmath>

namespace porthos::scene {

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
