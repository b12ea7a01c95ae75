#pragma once

/// What counts as nothing in runs with rigid contacts.
namespace porthos::contact {

/// A contact closes if the jump after its next impact would be lower [m | rad].
inline constexpr double least_height = 1e-14;
/// Contacts at most so far apart take part in one impact [m | rad].
inline constexpr double touching = 1e-12;
/// While a gap lifts it counts as wider by this: below it its sign is rounding [m | rad].
inline constexpr double lifted = 1e-13;
/// Where two rigid shapes overlap by more, a touch was missed [m | rad].
inline constexpr double most_overlap = 1e-6;
/// A slip that friction ends within this time is none [s].
inline constexpr double no_slip = 1e-13;
/// Friction follows the direction of a slip that it does not end within so many steps. Nearer to
/// its end it keeps that from the start of the step: the direction of a small slip is stiff.
inline constexpr double steps_to_stop = 4;

/// Of a flight that lasts `time` and ends at this speed.
inline double height(double speed, double time) { return 0.25 * speed * time; }

}  // namespace porthos::contact
