#pragma once
#include <span>

#include "space/link_forces.h"

/// The gravity gradient of a distant centre on a mechanism: the part that differs between links.
namespace porthos::space {

/// Expansion about the centre of mass to second order. R is the position of the centre of mass, u =
/// R/|R|, r_i the position of link i's own centre relative to it, and I_i the link's inertia about
/// its own centre:
///   force  f_i = m_i (μ/|R|³) (3 u uᵀ - 1) r_i,
///   torque about its centre  n_i = 3 (μ/|R|³) u × I_i u,
///   V = -(μ/2|R|³) (tr I - 3 u·I u),   I = Σ I_i + m_i (|r_i|² 1 - r_i r_iᵀ).
/// Everything is computed relative to the base, in its axes, so that positions of 7000 km are never
/// combined with those of a millimetre. Σ f_i = 0, so the translation of the whole is unaffected;
/// the reaction on the centre of mass is -∂V/∂R. Bodies that float beside the base belong to the
/// whole: their relative motion is then that of Hill, Clohessy and Wiltshire. Source: MacCullagh;
/// Hughes 1986, section 8.1, for one body; here applied to each link.
template <class T>
class GravityGradient {
 public:
  /// @throws InvalidArgument as LinkForces
  explicit GravityGradient(const Mechanism& m) : on_(m) {}

  /// Evaluates at coordinates q and centre of mass R [m, inertial], |R| > 0. Cost: about a third of
  /// a field evaluation.
  void evaluate(double mu, std::span<const T> q, const Vec3<T>& R);
  /// V [J].
  T energy() const { return energy_; }
  /// -∂V/∂R, the force on the centre of mass, inertial axes [N].
  const Vec3<T>& reaction() const { return reaction_; }
  /// Torque about the centre of mass, inertial axes [N m].
  const Vec3<T>& torque() const { return on_.torque(); }
  /// Joint forces, size nv. Those of the base are the torque, and the force that makes the sum over
  /// all trees zero.
  std::span<const T> joint_forces() const { return on_.joint_forces(); }
  /// Their contribution to p', size nq.
  void momentum_rates(std::span<const T> q, std::span<T> p_dot) const {
    on_.momentum_rates(q, p_dot);
  }
  /// How far the bodies reach from the centre of mass, after evaluate(): the largest distance of a
  /// link's centre with its radius of gyration [m]. The next order's accelerations are at most 3/2
  /// reach()/|R| of those of this one.
  T reach() const;
  /// Energy of the expansion's third order [J], from masses and inertias (without a link's own
  /// third moments, which no model provides). It estimates the neglected part, which is smaller
  /// than energy() by about |r|/|R|.
  T next_order(double mu, std::span<const T> q, const Vec3<T>& R);

  void set_turn_angles(std::span<const T> angles) { on_.set_turn_angles(angles); }

 private:
  LinkForces<T> on_;
  T energy_{};
  Vec3<T> reaction_;
};

#define PORTHOS_EXTERN(T) extern template class GravityGradient<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_EXTERN)
#undef PORTHOS_EXTERN

}  // namespace porthos::space
