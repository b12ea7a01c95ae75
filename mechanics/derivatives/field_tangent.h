#pragma once
#include <span>
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// The derivative of the Hamiltonian field f = (∂H/∂p, -∂H/∂q) of a mechanism at one state, as
/// products with vectors: two passes over the tree each, O(n), from the factor that the field
/// leaves. H = ½ pᵀM⁻¹p + V with uniform gravity; joint springs, damping and torques are no part.
///
/// The transpose needs no passes of its own: Df = J H'' with the Hessian H'' and J = [0 I; -I 0],
/// so Dfᵀ = -J Df J.
///
/// Directions are flat: dq and dp have nq numbers, quaternions four. One object per thread; nothing
/// allocates. Cost of a product: less than a field. Source: formulation in docs/derivatives.md.
template <class T>
class FieldTangent {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  /// m must outlive this object.
  explicit FieldTangent(const Mechanism& m);

  /// Moves to a state and writes the field there. Sizes nq each.
  void at(In q, In p, Out q_dot, Out p_dot);
  /// Sets 2π·turns of each angle block, before at(): helical joints advance by them.
  void set_turn_angles(In angles);
  /// Df (dq, dp) at that state: the derivative of the field along a direction.
  void times(In dq, In dp, Out dq_dot, Out dp_dot);
  /// Dfᵀ (lq, lp): what a covector on the field's values pulls back to.
  void transpose_times(In lq, In lp, Out out_q, Out out_p);

  /// The numbers that add_inertial_gradient() writes: ten of each moving body in the order of
  /// Mechanism::bodies(), in its own frame: mass [kg], first moment x y z [kg m], inertia about the
  /// origin xx xy xz yy yz zz [kg m²]; then the rotor inertia of each of joint_properties().
  static size_t inertial_count(const Mechanism& m);
  /// gradient += weight · D_w ∂H/∂θ at fixed momenta, along the direction w of the last product.
  /// After transpose_times() that is weight · ∂(λᵀf)/∂θ, because λᵀf = w·∇H. Size inertial_count().
  void add_inertial_gradient(const T& weight, Out gradient);
  /// In duals: from the next at() on these numbers change along the second part.
  void along_inertias(std::span<const double> change) {
    if constexpr (requires { w_.inertia_change; })
      static_cast<InertiaChanges&>(w_) = inertia_changes(m_, change);
  }

 private:
  void up(In dq, In dp);
  void down(In dq, In dp, Out dq_dot, Out dp_dot);

  const Mechanism& m_;
  Workspace<T> w_;
  std::vector<T> q_, p_, minus_, e_;  ///< e: momenta per freedom, eliminated
  std::vector<Motion<T>> carried_;    ///< V of the parent, in body axes
  std::vector<Force<T>> h_;           ///< momentum of the subtree
  std::vector<Vec3<T>> moment_;       ///< first moment of the subtree; with gravity
  std::vector<Motion<T>> zeta_;       ///< displacement of a body against its parent, in its axes
  std::vector<Force<T>> beta_, rho_;  ///< change of momentum and weight of the subtree, passed up
  std::vector<Motion<T>> dV_;
  std::vector<Vec3<T>> turn_, dgamma_;  ///< change of gravity in body axes
  std::vector<T> sinking_;              ///< change of gravity · origin
};

}  // namespace porthos::mechanics
