#pragma once
#include "mechanics/builder.h"
#include "mechanics/constraints/constraint_spec.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/state.h"

/// Maximal coordinates: every body is free in the world, and every joint is a loop that closes it.
namespace porthos::mechanics {

/// A mechanism in maximal coordinates, as parts and constraints.
struct MaximalForm {
  MechanismBuilder parts;
  ConstraintSpec constraints;
};

/// The mechanism of `tree` and `constraints` in maximal coordinates. Bodies keep their names and
/// frames. Each is free on a joint of its own name, but a body that was free keeps its joint, and
/// fixed joints stay. Each other joint is a loop joint of its name and type; the given loops, rods
/// and rolling bodies follow.
/// @throws InvalidArgument naming what acts on the coordinate of a joint, which is none here (a
///   spring, a damper, a rotor, a coupling, a motion); a universal joint whose axes are not normal
///   to each other; a body without inertia of its own
MaximalForm maximal_form(const MechanismBuilder& tree, const ConstraintSpec& constraints);

/// The state of `to`, a mechanism with bodies of the same names that are all free, in the motion
/// that `from` has in the state s: computed in 113 bits, with low words.
/// @throws InvalidArgument if `from` lacks a body of `to`
phs::State maximal_state(const MechanicalModel& from, const phs::State& s,
                         const MechanicalModel& to);

/// The time of a step of spark16, estimated from bodies, rows and the fill of the Delassus matrix
/// [µs, of one machine]: for comparing coordinates. It is within 40 % of what was measured for
/// lattices, booms and arms (docs/constraints.md).
double estimated_step(const MechanicalModel& model);

}  // namespace porthos::mechanics
