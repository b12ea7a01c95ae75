#pragma once
#include <span>
#include <vector>

#include "mechanics/hamiltonian_field.h"

/// Forces on the links of a floating system, relative to its centre of mass.
namespace porthos::space {

using mechanics::Mat3;
using mechanics::Mechanism;
using mechanics::Vec3;

/// Offsets of the free base's blocks in q and in p: position, then attitude.
inline constexpr int base_position = 0, base_attitude = 3;

/// Poses relative to the common centre of mass, in the axes of the first body (the base), and the
/// joint forces of wrenches on the links. The forces must sum to zero. In a frame that falls with
/// the centre of mass they do so to rounding. The remainder does not enter the translation: the
/// linear momenta of all trees sum to exactly zero.
template <class T>
class LinkForces {
 public:
  struct Link {
    double m;
    mechanics::Vec3d c;         ///< in the node's frame
    mechanics::Sym3<double> I;  ///< about c, node's axes
  };
  /// @throws InvalidArgument unless every tree of the mechanism is free, the base first, without
  ///   uniform gravity
  explicit LinkForces(const Mechanism& m);

  /// At coordinates q (size nq): computes poses and sets all wrenches to zero.
  void place(std::span<const T> q);
  const std::vector<Link>& links() const { return links_; }
  const Mat3<T>& base() const { return base_; }  ///< base to inertial
  const Mat3<T>& axes(size_t i) const { return pose_[i].R; }
  /// Position of the link's own centre relative to the common one, link's axes [m].
  Vec3<T> centre(size_t i) const {
    return pose_[i].R.tmul(pose_[i].r - centre_) + Vec3<T>(links_[i].c);
  }
  /// The wrench on link i about its node's origin, in its axes. Set it or add to it between place()
  /// and project().
  mechanics::Force<T>& wrench(size_t i) { return w_.g[i]; }

  /// Converts the wrenches to joint forces; overwrites the wrenches.
  void project();
  /// Of each freedom [N | N m], size nv.
  std::span<const T> joint_forces() const { return force_; }
  /// Of all wrenches about the centre of mass, inertial axes [N m].
  const Vec3<T>& torque() const { return torque_; }
  /// Their contribution to p'. q, p_dot: size nq
  void momentum_rates(std::span<const T> q, std::span<T> p_dot) const;
  void set_turn_angles(std::span<const T> angles);

 private:
  const Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::vector<Link> links_;
  std::vector<mechanics::Transform<T>> pose_;  ///< in the base's frame
  Mat3<T> base_;
  Vec3<T> centre_;  ///< of mass, in the base's frame
  std::vector<T> force_;
  Vec3<T> torque_;
};

#define PORTHOS_EXTERN(T) extern template class LinkForces<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_EXTERN)
#undef PORTHOS_EXTERN

}  // namespace porthos::space
