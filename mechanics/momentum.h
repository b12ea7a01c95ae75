#pragma once
#include "mechanics/hamiltonian_field.h"

namespace porthos::mechanics {

/// Linear and angular momentum of a mechanism.
template <class T>
struct Momentum {
  Vec3<T> linear;   ///< world axes [kg m/s]
  Vec3<T> angular;  ///< about the world's origin, world axes [kg m²/s]
};

/// Flat momenta p from the joint rates v; also leaves the twists in w.V. Cost: one momentum pass,
/// no articulated inertia.
/// @param q  size nq;  v size nv;  p written, size nq
template <class T>
void momenta_from_rates(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                        std::span<const T> v, std::span<T> p);

/// Total momentum at (q, p). For bodies free in the world it is computed directly from p, so it is
/// linear or bilinear in the state: angular = Σ ½ Im(π ξ̄) + x × P.
///
/// It is the momentum of the bodies, without the spin of rotors (JointSpec::rotor_inertia). It is
/// conserved nevertheless, to rounding: the rotor energy ½ n²J q̇² does not depend on the position
/// and attitude of the whole mechanism, so the momentum of its rigid motion (Noether) has no rotor
/// term. The sum of this momentum and the rotor spin is not conserved.
template <class T>
Momentum<T> momentum(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                     std::span<const T> p);

/// Centroidal momentum matrix: (k_G, l) = A_G v, k_G about the centre of mass, world axes, rows
/// [angular; linear]. Like `momentum`, it counts the bodies without the spin of rotors.
/// @param q  size nq;  A written, 6 × nv column-major.  Source: Orin, Goswami, Lee 2013.
template <class T>
void centroidal_momentum_matrix(const Mechanism& m, Workspace<T>& w, std::span<const T> q,
                                std::span<T> A);

/// Centre of mass of the moving bodies in the world [m]. @param q  size nq
template <class T>
Vec3<T> centre_of_mass(const Mechanism& m, Workspace<T>& w, std::span<const T> q);

/// T = ½ pᵀ q' at (q, p) [J]. @param q, p  size nq each
template <class T>
T kinetic_energy(const Mechanism& m, Workspace<T>& w, std::span<const T> q, std::span<const T> p);

/// The kinetic energy of the bodies that are free in the world (the base of a spacecraft), from the
/// twists that kinetic_energy() left in w.V [J].
template <class T>
T base_kinetic_energy(const Mechanism& m, const Workspace<T>& w);

/// V = -Σ m_i g·c_i, zero at the world's origin [J]. It excludes joint springs, which belong to the
/// system (mechanical_model.h). @param q  size nq
template <class T>
T potential_energy(const Mechanism& m, Workspace<T>& w, std::span<const T> q);

/// Scales for momenta that may be zero: Σ m_i |v_i| and Σ |I_i| |ω_i| + m_i |c_i - c| |v_i - v_c|
/// over the moving bodies. c and v_c are position and velocity of their centre of mass, so the
/// second scale does not depend on where the whole mechanism is and how fast it translates.
struct MomentumScale {
  double linear, angular;  ///< [N s], [N m s]
};
/// The scales at q (size nq) and joint rates v (size nv).
MomentumScale momentum_scale(const Mechanism& m, Workspace<double>& w, std::span<const double> q,
                             std::span<const double> v);

}  // namespace porthos::mechanics
