#pragma once
#include <fmt/format.h>

#include <string>

/// Why a run with rigid contacts ends; {} is the name of the contact.
namespace porthos::contact::endings {

inline constexpr const char* presses =
    "friction presses '{}' harder than it can yield, so its force is not unique (Painlevé): "
    "expected less friction, or a soft contact";
/// Points that hold each other: which of them slips first depends on how they share friction.
inline constexpr const char* undecided =
    "several points of '{}' stick and hold each other, so their friction is not unique, and one "
    "would slip: expected method = \"moreau\", or a soft contact";
inline constexpr const char* chatters =
    "'{}' changes between slip and stick more often than a hundred times a point in one step: "
    "expected method = \"moreau\", or a soft contact";
inline constexpr const char* missed =
    "the shapes of '{}' overlap, a touch was missed: expected a shorter step, or method = "
    "\"moreau\"";
/// half: in which the last half of the jumps happened, of all in `time` [s].
inline std::string crowded(bool others, double half, double time) {
  return fmt::format(
      "'{{}}' {} ten thousand times in one step: expected {}method = \"moreau\"",
      others ? "and others jump" : "jumps",
      half > 1e-6 * time ? fmt::format("a step of at most {:.1g} s, or ", half) : "");
}

}  // namespace porthos::contact::endings
