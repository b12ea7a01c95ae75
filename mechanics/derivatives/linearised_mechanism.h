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

/// A gradient with respect to a start that is given by coordinates and rates.
struct StartGradient {
  std::vector<double> q, v;        ///< sizes nq, nv
  std::vector<double> parameters;  ///< as linearise(); what the momenta p(q, v, θ) add
};
/// From λ = ∂J/∂x of x = (q, p): the gradient along q and v, where p = M(q) v. A parameter's whole
/// derivative is that with x kept plus the one here.
/// @param q  size nq;  v: joint rates, size nv;  lambda: size 2 nq
StartGradient start_in_rates(const Mechanism& m, std::span<const double> q,
                             std::span<const double> v, std::span<const double> lambda);

/// ∂H/∂θ at fixed x = (q, p), as linearise(): of the kinetic energy, gravity and joint springs.
/// @param x  size 2 nq;  turns: of its angle blocks
std::vector<double> energy_by_parameters(const Mechanism& m, std::span<const double> x,
                                         std::span<const std::int64_t> turns);

}  // namespace porthos::mechanics
