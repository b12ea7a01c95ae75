// Trees that are hung on another link than their root, and put back.
#include <algorithm>
#include <array>

#include "mechanics/detail/turning.h"

namespace porthos::mechanics {
namespace {

const std::string turned_suffix = ".turned", mount_suffix = ".mount";

/// Whether the joint with its axis reversed is the joint seen from the child, q and all.
bool has_one_axis(const JointSpec& j) {
  const std::array one{"revolute", "continuous", "prismatic", "helical", "cylindrical"};
  return std::find(one.begin(), one.end(), j.type) != one.end();
}

JointSpec reversed(JointSpec joint, const std::string& name, bool turned) {
  joint.name = name;
  joint.axis = -joint.axis;
  joint.turned = turned;
  return joint;
}

Pose inverse_of(const Pose& p) { return lowered(inverse(Instant::lifted(p))); }

/// parent -> joint -> child becomes child -> joint -> a frame -> parent: X(q; a)⁻¹ = X(q; -a).
void exchange(MechanismBuilder& parts, BodySpec parent_was, const BodySpec& child_was) {
  const std::string joint = joint_of(child_was);
  BodySpec& parent = body_of(parts, parent_was.name, "capture");
  parent.placement = inverse_of(child_was.placement);
  parent.joint = {};
  if (child_was.joint.type == "fixed") {
    parent.parent = child_was.name;
    parent.joint.name = joint;
    return;
  }
  if (child_was.joint.turned) {  // turned before: the frame carries what it hung on
    parent.parent = child_was.name;
    parent.joint = reversed(child_was.joint, joint, false);
    return;
  }
  BodySpec frame;
  frame.name = joint + turned_suffix;
  frame.parent = child_was.name;
  frame.where = child_was.where;
  frame.joint = reversed(child_was.joint, joint, true);
  parent.parent = frame.name;
  parent.joint.name = joint + mount_suffix;
  parts.add(std::move(frame));
}

}  // namespace

std::vector<BodySpec> way_to(const MechanismBuilder& parts, const std::string& body) {
  std::vector<BodySpec> way;
  for (std::string at = body; at != "world"; at = way.back().parent)
    way.push_back(find_named(parts.bodies(), at, "capture: there is no body"));
  std::reverse(way.begin(), way.end());
  return way;
}

void turn_round(MechanismBuilder& parts, const std::vector<BodySpec>& way) {
  for (size_t i = 1; i < way.size(); ++i)
    if (way[i].joint.type != "fixed" && !has_one_axis(way[i].joint))
      throw InvalidArgument("capture: joint '" + joint_of(way[i]) + "' between '" +
                            way.back().name + "' and the root '" + way.front().name + "' is " +
                            way[i].joint.type +
                            ", expected joints of one axis there (a loop of type \"fixed\" that "
                            "closes joins any two links)");
  for (size_t i = 1; i < way.size(); ++i) exchange(parts, way[i - 1], way[i]);
}

void turn_back(MechanismBuilder& parts, const std::vector<BodySpec>& way, const Instant& now,
               LockedJoints& locked) {
  for (const BodySpec& was : way) {
    const std::string joint = joint_of(was), frame = joint + turned_suffix;
    BodySpec& body = body_of(parts, was.name, "release");
    body.parent = was.parent;
    body.placement = was.placement;
    body.joint = was.joint;
    if (!was.joint.turned)
      std::erase_if(parts.bodies(), [&](const BodySpec& b) { return b.name == frame; });
    const auto lock = locked.find(joint);
    if (lock == locked.end() || was.joint.type == "fixed") continue;
    lock->second.free = was;
    BodySpec& held = body_of(parts, was.name, "release");  // the list has moved
    held.placement = lowered(inverse(now.pose(was.parent)) * now.pose(was.name));
    held.joint = {};
    held.joint.name = joint;
  }
}

}  // namespace porthos::mechanics
