#include "scene/run/loop_events.h"

#include <fmt/format.h>

#include <algorithm>

namespace porthos::scene {
namespace {

bool is_closed(const mechanics::ConstraintSpec& spec, const std::string& name) {
  const auto has = [&](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto& x) { return x.name == name; });
  };
  return has(spec.loops) || has(spec.rods) || has(spec.couplings);
}

}  // namespace

void check_closing(const Scene& scene, const Event& e) {
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("{}: {}", e.where, why));
  };
  const auto one = scene.constraints.awaited(e.name);
  if (!one.loops.empty() && !one.loops[0].points.empty())
    refuse("'" + e.name +
           "' holds a point on a curve and cannot close as the mechanism stands, expected another "
           "type of loop");
  const double least = std::min({e.latch.reach, e.latch.speed, e.latch.rate});
  if (!one.couplings.empty() && (e.within_reach || least < HUGE_VAL))
    refuse("coupling '" + e.name + "' joins no two frames, expected a time and no limits");
  if (!one.loops.empty() && e.latch.reach == HUGE_VAL)
    refuse("the closing of '" + e.name +
           "' lacks the key 'reach', expected the largest gap of its frames in metres");
}

mechanics::Latch limits_of_closing(const Scene& scene, const Event& e) {
  mechanics::Latch limits = e.latch;
  const auto between = [&](const mechanics::LinkFrame& a, const mechanics::LinkFrame& b) {
    limits.link = a.link;
    limits.on_link = a.pose.r;
    limits.body = b.link;
    limits.on_body = b.pose.r;
  };
  const auto one = scene.constraints.awaited(e.name);
  if (!one.loops.empty()) between(one.loops[0].a, one.loops[0].b);
  if (!one.rods.empty()) between(one.rods[0].a, one.rods[0].b);
  return limits;
}

mechanics::Impact close(const Scene& scene, mechanics::MovingMechanism& moving, const Event& e) {
  try {
    if (is_closed(moving.constraints, e.name))
      throw InvalidArgument("it is closed already, expected an open one");
    const mechanics::Latch limits = limits_of_closing(scene, e);
    const auto one = scene.constraints.awaited(e.name);
    if (one.couplings.empty()) mechanics::require_within_limits(moving, limits, text(e));
    return mechanics::close_loop(moving, one);
  } catch (const InvalidArgument& why) {
    const std::string what = why.what(), who = text(e) + ": ";
    throw InvalidArgument(
        fmt::format("{}: at {:g} s: {}{}", e.where, e.at, what.starts_with(who) ? "" : who, what));
  }
}

}  // namespace porthos::scene
