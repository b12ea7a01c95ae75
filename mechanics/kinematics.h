#pragma once
#include <array>

#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Poses of the moving bodies' frames in the world, root to leaf: x_world = R x_body + r, r [m].
/// @param q size nq;  pose written, one per moving body (Mechanism::nodes order; a user's body:
///   body_pose)
template <class T>
void forward_kinematics(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<Transform<T>> pose);

/// Pose of a user's body in the world. @param node_pose  as forward_kinematics() wrote them
template <class T>
Transform<T> body_pose(const Mechanism& m, const BodyFrame& body,
                       std::span<const Transform<T>> node_pose);

/// The axes of a Jacobian's rows. In both cases the reference point is the body frame's origin.
enum class JacobianAxes { body, world };

/// Jacobian of a body frame: its twist is J v, [angular; linear]. The linear part is the velocity
/// of the frame's origin.
/// @param q  size nq;  J written, 6 × nv column-major. Cost: the path to the root.
template <class T>
void jacobian(const Mechanism& m, Workspace<T>& w, std::span<const T> q, const BodyFrame& body,
              JacobianAxes axes, std::span<T> J);

/// Derivatives q' of the coordinates from joint rates v: of angles and slides q' = v, of a
/// quaternion four numbers from the three of an angular velocity.
/// @param q  size nq;  v size nv [rad/s | m/s];  q_dot written, size nq
template <class T>
void coordinate_rates(const Mechanism& m, std::span<const T> q, std::span<const T> v,
                      std::span<T> q_dot);

/// (w, x, y, z) of a rotation.
std::array<double, 4> quaternion_of(const Mat3<double>& R);

}  // namespace porthos::mechanics
