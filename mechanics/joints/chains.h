#pragma once
#include <array>
#include <string_view>

#include "mechanics/joints/joint.h"

namespace porthos::mechanics {

/// One link of a chain joint: a primitive joint, the user's axis that it uses, and the suffix of
/// its coordinate's name.
enum class ChainAxis { first, second, third };
struct ChainLink {
  std::string_view primitive;
  ChainAxis axis;
  const char* suffix;
};

/// Unlimited rotation: URDF's name for a revolute joint.
struct Continuous {
  static constexpr std::string_view name = "continuous";
  static constexpr std::array chain{ChainLink{"revolute", ChainAxis::first, ""}};
};

/// Two rotations: about the first axis in the parent, then about the second axis in the rotated
/// frame.
struct Universal {
  static constexpr std::string_view name = "universal";
  static constexpr std::array chain{ChainLink{"revolute", ChainAxis::first, ".first"},
                                    ChainLink{"revolute", ChainAxis::second, ".second"}};
};

/// Motion in the plane normal to the first axis: two translations along the second and third axis,
/// fixed in the parent, then a rotation about the first.
struct Planar {
  static constexpr std::string_view name = "planar";
  static constexpr std::array chain{ChainLink{"prismatic", ChainAxis::second, ".x"},
                                    ChainLink{"prismatic", ChainAxis::third, ".y"},
                                    ChainLink{"revolute", ChainAxis::first, ".angle"}};
};

/// No degree of freedom: the builder merges the body into its parent.
struct Fixed {
  static constexpr std::string_view name = "fixed";
  static constexpr std::array<ChainLink, 0> chain{};
};

}  // namespace porthos::mechanics
