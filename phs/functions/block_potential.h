#pragma once
#include <memory>
#include <span>

#include "phs/scalars/scalar.h"

/// Potentials of a coordinate of several numbers: of a place in space, or of an attitude.
namespace porthos::phs {

/// U(z), z the numbers of one coordinate block. Immutable, shared between threads.
class BlockPotential {
 public:
  virtual ~BlockPotential() = default;
  virtual int size() const = 0;  ///< of z
#define PORTHOS_EVALUATE(T)                                                     \
  virtual T energy(std::span<const T> z) const = 0;                     /* J */ \
  virtual void slope(std::span<const T> z, std::span<T> out) const = 0; /* ∂U/∂z */
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
};
using BlockPotentialPtr = std::shared_ptr<const BlockPotential>;

/// The numbers of the largest block, a quaternion.
inline constexpr int most_of_a_block = 4;

/// An isotropic rotational spring on a quaternion ξ = (w, x, y, z) of any length:
///   U = k (1 - cos θ) = (k/2) tr(I - R),   θ the angle of the rotation R from the rest attitude,
/// so the torque is k sin θ about the axis of rotation: k θ for small angles, largest at a quarter
/// of a turn, zero at half a turn, where the equilibrium is unstable. U is smooth everywhere. With
/// the unit quaternion ρ of the rest attitude and d = ρ - (ρ·ξ/|ξ|²) ξ it is U = 2 k |d|², and
/// ξ·∂U/∂ξ = 0, so the norm of ξ and its gauge are kept. Source: the trace function of Koditschek
/// 1989; Bullo, Murray 1999, Automatica 35, with all gains equal.
/// @param stiffness  k [N m/rad], 0 or more
/// @param rest  quaternion (w, x, y, z) of any length above 0
/// @throws InvalidArgument for a negative stiffness or a rest of length 0
BlockPotentialPtr attitude_spring(double stiffness, std::span<const double, 4> rest);

/// An isotropic spring on a place in space: U = ½ k |r - rest|².
/// @param stiffness  k [N/m], 0 or more
/// @param rest  [m]
/// @throws InvalidArgument for a negative stiffness
BlockPotentialPtr place_spring(double stiffness, std::span<const double, 3> rest);

}  // namespace porthos::phs
