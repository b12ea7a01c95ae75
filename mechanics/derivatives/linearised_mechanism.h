#pragma once
#include <memory>

#include "mechanics/mechanism.h"
#include "phs/system/linearised.h"

namespace porthos::mechanics {

/// The field of a mechanism with its joint springs and damping, and its derivative: two passes a
/// product (FieldTangent). x = (q, p).
///
/// Parameters, in SI units: "<body>.mass", "<body>.moment.x" (first moment about the body's origin,
/// in its axes), "<body>.inertia.xx" (about that origin; .xy stands for both elements), and
/// "<joint>.rotor_inertia", "<joint>.stiffness", "<joint>.damping", "<joint>.rest". m must outlive
/// the result.
template <class T>
std::unique_ptr<phs::Linearised<T>> linearise(const Mechanism& m);

}  // namespace porthos::mechanics
