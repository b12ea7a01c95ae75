#include "scene/run/limit_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace porthos::scene {

std::vector<std::string> notes_on_speeds(const mechanics::MechanicalModel& model,
                                         const phs::State& state, const std::string& when) {
  struct Fast {
    const mechanics::JointProperties* joint;
    double rate, excess;
  };
  std::vector<Fast> worst;
  std::vector<double> v;
  const auto& joints = model.mechanism().joint_properties();
  for (const auto& j : joints) {
    if (!j.rate || !(*j.rate > 0)) continue;
    if (v.empty())
      v = model.rates(std::span(state.x).first(size_t(model.description().nx)),
                      std::span(state.turns).first(size_t(model.mechanism().angle_count())));
    const double rate = v[size_t(j.v)], excess = std::fabs(rate) / *j.rate;
    if (excess > 1) worst.push_back({&j, rate, excess});
  }
  if (worst.empty()) return {};
  std::ranges::stable_sort(worst, std::greater(), &Fast::excess);
  std::string list;
  for (const auto& [j, rate, excess] : std::span(worst).first(std::min(worst.size(), most_told))) {
    const char* unit = j->turn >= 0 ? "rad/s" : "m/s";
    list += list.empty()
                ? fmt::format("joint '{}' moves at {:.6g} {} {}, faster than its {:.6g} {}",
                              j->joint, rate, unit, when, *j->rate, unit)
                : fmt::format(", '{}' at {:.6g} {} ({:.6g})", j->joint, rate, unit, *j->rate);
  }
  if (worst.size() > most_told) list += fmt::format(", and {} more", worst.size() - most_told);
  return {list + ": velocities of the model file's limits do not act"};
}

}  // namespace porthos::scene
