#pragma once
#include <string>

#include "mechanics/builder.h"

/// Checks that MechanismBuilder applies to a body and its joint. Private to the building of
/// mechanisms.
namespace porthos::mechanics {

[[noreturn]] void refuse(const BodySpec& b, const std::string& text);
[[noreturn]] void refuse_joint(const BodySpec& b, const std::string& text);

/// Orthonormal and right-handed to the digits of typical files.
bool is_rotation(const Mat3<double>& R);

/// The fault of an inertia about the centre of mass, or "".
std::string inertia_fault(double mass, const Sym3<double>& inertia);
double smallest_principal_moment(const Sym3<double>& inertia);
/// Sets principal moments that are negative by rounding to zero. @return the smallest of them; 0 if
/// none was
double lift_to_zero(MassProperties& m);

/// Finite numbers, a mass of 0 or more, axes that are rotations.
void check_numbers(const BodySpec& b);

}  // namespace porthos::mechanics
