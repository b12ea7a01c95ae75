#include "scene/run/joint_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "scene/assemble/assembly.h"
#include "scene/run/limit_notes.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

JointLimits::JointLimits(const Scene& scene, const Assembly& assembly, const RecordLayout& layout)
    : layout_(layout), turns_(layout.turns) {
  if (!assembly.mechanical) return;
  const auto acts = [&](const std::string& joint) {
    return std::ranges::any_of(scene.elements, [&](const Element& e) {
      return (e.type == "limits" || e.stop) && e.joint == joint;
    });
  };
  for (const auto& j : assembly.mechanical->mechanism().joint_properties()) {
    if (!(j.lower || j.upper) || acts(j.joint)) continue;
    Joint joint{j.joint, size_t(j.q), {}, j.lower, j.upper};
    if (j.turn >= 0) joint.turn = size_t(j.turn);
    joints_.push_back(std::move(joint));
  }
}

void JointLimits::see(Joint& j, double z, double time) const {
  double beyond = 0;
  if (j.lower) beyond = std::max(beyond, *j.lower - z);
  if (j.upper) beyond = std::max(beyond, z - *j.upper);
  if (!(beyond > j.beyond)) return;
  j.beyond = beyond;
  j.position = z;
  j.time = time;
  j.at_start = !begun_;
}

void JointLimits::see(std::span<const double> record) {
  if (!any()) return;
  turns_of(layout_, record, turns_);
  for (Joint& j : joints_) {
    if (j.at_start) continue;
    const size_t at = layout_.x() + j.q, least = layout_.least(at);
    const double turned = j.turn ? phs::two_pi_hi * double(turns_[*j.turn]) : 0;
    if (least == at) {
      see(j, record[at] + turned, record[layout_.time()]);
      continue;
    }
    see(j, record[least], record[layout_.time()]);  // has its turns
    see(j, record[layout_.largest(at)], record[layout_.time()]);
  }
  begun_ = true;
}

void JointLimits::fill(RunReport& report) const {
  std::vector<Joint> worst = joints_;
  std::erase_if(worst, [](const Joint& j) {
    return !(j.beyond > 1e-12);  // rounding, as of a joint that rests at its stop
  });
  if (worst.empty()) return;
  std::ranges::stable_sort(worst, std::greater(), &Joint::beyond);
  std::string list;
  for (const Joint& j : std::span(worst).first(std::min(worst.size(), most_told))) {
    const char* unit = j.turn ? "rad" : "m";
    const bool below = j.lower && j.position < *j.lower;
    const std::string where =
        j.at_start ? fmt::format("is at {:.6g} {} at the start", j.position, unit)
                   : fmt::format("reaches {:.6g} {} at {:.6g} s", j.position, unit, j.time);
    list +=
        fmt::format("{}'{}' {}, beyond its {} limit of {:.6g} {}", list.empty() ? "joint " : "; ",
                    j.name, where, below ? "lower" : "upper", below ? *j.lower : *j.upper, unit);
  }
  for (size_t k = most_told; k < worst.size(); ++k)
    list += fmt::format("{}'{}'", k == most_told ? "; less far beyond: " : ", ", worst[k].name);
  report.notes.push_back(list +
                         ": limits of the model file do not act without an element of type "
                         "\"limits\" or \"joint_stop\" (a hard one with law = \"rigid\" and a "
                         "restitution)");
}

}  // namespace porthos::scene
