#pragma once
#include <array>
#include <string_view>

#include "mechanics/rotation.h"
#include "mechanics/screw.h"
#include "phs/system/description.h"

/// The interface of a joint type to the kernels.
///
/// The builder rotates the child frame so that a joint's axis is always z. A primitive joint has nv
/// degrees of freedom with constant motion subspace S = [S_0 ... S_{nv-1}] in the child frame, and
/// provides
///
///   about_z           whether the joint is a screw about z
///   screw             that screw, from q (of an angle block also: sine and cosine, 2π·turns)
///   place             of other joints: child pose in the parent, from q
///   project<k>        S_kᵀ f
///   add<k>            v += S_k·rate
///   column<k>         A S_k for an articulated or rigid inertia A
///   add_cross<k>      a += V × S_k·rate
///   momentum, lift    joint momentum μ = Sᵀh from the flat (q, p), and back
///   transposed_lift   the transpose of p = lift(q) μ, of a covector on p
///   rates             q' from q and the joint rates
///   field             lifted joints only: (q', p') from rates, the body's twist V, the subtree's
///                     momentum h and the load Sᵀg + τ. Of plain joints q' = rates and
///                     p' = Sᵀ(g - V ×* h) + τ.
///
/// The kernels eliminate a joint of several freedoms one S_k at a time, so the recursions handle
/// only single freedoms. A chain joint (universal, planar, ...) is a series of primitives with
/// massless bodies between them.
namespace porthos::mechanics {

/// The constants of one moving body and its joint, in the frames the kernels use.
struct Node {
  int type = 0;            ///< index in PrimitiveJoints
  int parent = -1;         ///< node index, -1 for the world
  int q = 0;               ///< offset in q and in p
  int v = 0;               ///< offset in v
  int turn = -1;           ///< index among the angle blocks, -1 if the joint has none
  bool leaf = true;        ///< no child nodes
  bool last_child = true;  ///< of its parent's children: the first one visited from the leaves
  /// Joint frame in the parent's frame. At q = 0 the body's own frame is `zero` further.
  Transform<double> placement;
  Screw<double> zero{1, 0, 0};  ///< about z, of joints about z
  /// Whether the placement is a screw about the parent's z, `before`, then one about x, `tilt`.
  bool axial = false;
  FixedScrew before, tilt;
  double pitch = 0;          ///< helical: advance per radian [m/rad]
  double rotor_inertia = 0;  ///< adds to the joint's own entry of M; joints of one freedom
  RigidInertia<double> inertia;
  /// Mass of the body and all that it carries [kg], and what its rounding left out, for wider
  /// scalars.
  double subtree_mass = 0, subtree_mass_low = 0;
};

/// The pose of a body in its parent with all coordinates of its joint zero (quaternions 1).
inline Transform<double> neutral_pose(const Node& n) { return n.placement * pose_about_z(n.zero); }

/// The meaning of one coordinate block of a joint.
struct CoordinateBlock {
  phs::BlockKind kind;
  int size;
  const char* suffix;  ///< appended to the joint's name where a joint has several blocks
  const char *unit, *momentum_unit, *effort_unit, *rate_unit;
};

/// S made of unit twists: axes 0 1 2 rotate about x y z, 3 4 5 translate along x y z.
template <int... axes>
struct AxisJoint {
  static constexpr bool about_z = ((axes == 2 || axes == 5) && ...);
  static constexpr int nv = sizeof...(axes);
  static constexpr std::array<int, sizeof...(axes)> axis{axes...};

  template <int k, class T>
  static T project(const Node&, const Force<T>& f) {
    return f[axis[k]];
  }
  template <int k, class T>
  static void add(const Node&, T rate, Motion<T>& v) {
    v[axis[k]] = v[axis[k]] + rate;
  }
  template <int k, class Inertia>
  static auto column(const Node&, const Inertia& A) {
    return A.template column<axis[k]>();
  }
  template <int k, class T>
  static void add_cross(const Node&, const Motion<T>& V, T rate, Motion<T>& a) {
    add_cross_unit<axis[k]>(V, rate, a);
  }
};

/// Joints whose joint rates are the derivatives of their coordinates: q' = v, μ = p.
template <int n>
struct PlainCoordinates {
  static constexpr bool lifted = false;
  static constexpr int nq = n;
  template <class T>
  static void momentum(const T*, const T* p, T* mu) {
    for (int k = 0; k < n; ++k) mu[k] = p[k];
  }
  template <class T>
  static void lift(const T*, const T* mu, T* p) {
    for (int k = 0; k < n; ++k) p[k] = mu[k];
  }
  template <class T>
  static void transposed_lift(const T*, const T* e, T* y) {
    for (int k = 0; k < n; ++k) y[k] = e[k];
  }
  template <class T>
  static void rates(const T*, const T* v, T* q_dot) {
    for (int k = 0; k < n; ++k) q_dot[k] = v[k];
  }
};

/// The numbers of an angle block: sine and cosine of the angle, and 2π times its turns.
template <class T>
struct Angle {
  T sine, cosine, turns;
};

}  // namespace porthos::mechanics
