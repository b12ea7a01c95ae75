#pragma once

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
inline constexpr const char* crowded =
    "'{}' and others jump ten thousand times in one step: expected method = \"moreau\", or a "
    "shorter step";
inline constexpr const char* missed =
    "the shapes of '{}' overlap, a touch was missed: expected a shorter step, or method = "
    "\"moreau\"";

}  // namespace porthos::contact::endings
