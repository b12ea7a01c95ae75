#pragma once
#include <span>
#include <vector>

#include "mechanics/hamiltonian_field.h"

/// The gravity of a distant centre on a mechanism, as far as it differs from link to link.
namespace porthos::space {

using mechanics::Mechanism;
using mechanics::Vec3;

/// Expansion about the centre of mass to second order: with R the position of the centre of mass, u = R/|R|, r_i that of
/// link i's own centre relative to it and I_i the link's inertia about its own,
///   force  f_i = m_i (μ/|R|³) (3 u uᵀ - 1) r_i,      torque about its centre  n_i = 3 (μ/|R|³) u × I_i u,
///   V = -(μ/2|R|³) (tr I - 3 u·I u),   I = Σ I_i + m_i (|r_i|² 1 - r_i r_iᵀ).
/// Everything is computed relative to the base, in its axes: no position of 7000 km meets one of a millimetre.
/// Σ f_i = 0, so the translation of the whole is not touched; the reaction on the centre of mass is -∂V/∂R.
/// Source: MacCullagh; Hughes 1986, section 8.1, for one body; here for each link.
template <class T>
class GravityGradient {
 public:
  /// @throws InvalidArgument unless the mechanism is one tree on a free base, without uniform gravity
  explicit GravityGradient(const Mechanism& m);

  /// At coordinates q and centre of mass R [m, inertial], |R| > 0. Cost: about a third of a field evaluation.
  void evaluate(double mu, std::span<const T> q, const Vec3<T>& R);
  /// V [J].
  T energy() const { return energy_; }
  /// -∂V/∂R, the force on the centre of mass, inertial axes [N].
  const Vec3<T>& reaction() const { return reaction_; }
  /// Torque about the centre of mass, inertial axes [N m].
  const Vec3<T>& torque() const { return torque_; }
  /// Joint forces, size nv; of the base: the torque, and no force.
  std::span<const T> joint_forces() const { return force_; }
  /// What they add to p', size nq.
  void momentum_rates(std::span<const T> q, std::span<T> p_dot) const;
  /// Energy of the expansion's third order [J], from masses and inertias (a link's own third moments are left out, no
  /// model gives them): what is neglected, over energy() about |r|/|R| small.
  T next_order(double mu, std::span<const T> q, const Vec3<T>& R);

  void set_turn_angles(std::span<const T> angles);

 private:
  struct Link {
    double m;
    mechanics::Vec3d c;         ///< in the node's frame
    mechanics::Sym3<double> I;  ///< about c, node's axes
  };
  void place(std::span<const T> q);
  const Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::vector<Link> links_;
  std::vector<mechanics::Transform<T>> pose_;  ///< in the base's frame
  Vec3<T> centre_;                             ///< of mass, in the base's frame
  std::vector<T> force_;
  T energy_{};
  Vec3<T> reaction_, torque_;
};

/// Offsets of the free base's blocks in q and in p: position, then attitude.
inline constexpr int base_position = 0, base_attitude = 3;

#define PORTHOS_EXTERN(T) extern template class GravityGradient<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_EXTERN)
#undef PORTHOS_EXTERN

}  // namespace porthos::space
