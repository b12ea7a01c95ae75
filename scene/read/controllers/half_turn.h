#pragma once
#include <array>
#include <string>

#include "mechanics/mechanism.h"
#include "scene/read/controllers/controller_type.h"

/// Half turns, at which a spring of the trace potential has no moment (PoseSpring).
namespace porthos::scene {

/// The attitude of a link at the start to the world, a quaternion wxyz: as [initial] or the record
/// it begins from states it, with the joints of stated_start().
std::array<double, 4> start_attitude(const ControllerPlant& plant, const std::string& link);

/// Whether the turn between two attitudes (wxyz) is within 5 degrees of a half turn, and the moment
/// of the trace potential there at most that of 5 degrees about its stiffest axis. Of unequal
/// stiffness only half turns about its axes are rests.
bool near_half_turn(const std::array<double, 4>& from, const std::array<double, 4>& to,
                    const mechanics::Vec3d& stiffness);

/// A remark on a pose that begins near such a half turn.
std::string half_turn_of_pose(const std::string& link);

/// Adds a sentence behind what a remark says; nothing of an empty one.
void add_sentence(std::string& remark, const std::string& sentence);

}  // namespace porthos::scene
