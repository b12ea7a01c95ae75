#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mechanics/joints/joint.h"
#include "phs/error.h"
#include "phs/system/state.h"

namespace porthos::mechanics {

using Vec3d = Vec3<double>;
using Pose = Transform<double>;

/// A coordinate block of the mechanism: the offsets of a joint's numbers in q (and p) and in v (and
/// tau).
struct JointCoordinates {
  std::string
      name;  ///< joint name, with a suffix where a joint has several blocks ("base.attitude")
  std::string joint;  ///< name of the joint it belongs to
  phs::BlockKind kind;
  int node;
  int q, nq;  ///< offset and size in q and p
  int v, nv;  ///< offset and size in v and tau
  std::string unit, momentum_unit, effort_unit, rate_unit;
};

/// A body with the frame in which the user gave it. Bodies on fixed joints share a node.
struct BodyFrame {
  std::string name;
  int node;   ///< -1: fixed to the world
  Pose pose;  ///< the body's frame in the node's frame (in the world for node -1)
};

/// Joint properties that are not part of the kinematics.
struct JointProperties {
  std::string joint;
  int q = 0, v = 0;      ///< its coordinate in q and its freedom in v
  int turn = -1;         ///< its angle block, -1 for a translation
  double damping = 0;    ///< viscous torque per rate [N m s/rad | N s/m], >= 0
  double stiffness = 0;  ///< spring constant [N m/rad | N/m], >= 0
  double rest = 0;       ///< spring's rest coordinate [rad | m]
  double friction = 0;   ///< Coulomb friction as read from a file; reported, not simulated
  std::optional<double> lower, upper;  ///< limits as read from a file; reported, not enforced
  std::optional<double> effort, rate;  ///< likewise: largest |torque| and |rate|
  double rotor_inertia = 0;            ///< see JointSpec; the kernels read Node's
};

/// A remark on the input that does not prevent a run.
struct Remark {
  std::string where;  ///< "file:line", may be empty
  std::string text;
};

/// An articulated mechanism: an immutable tree of bodies, shared between threads. MechanismBuilder
/// makes it.
///
/// q = joint coordinates, v = joint rates (for ball and free joints body-frame twists, [angular;
/// linear]), p = momenta conjugate to q, of the same size as q.
class Mechanism {
 public:
  const std::string& name() const { return name_; }
  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int body_count() const {
    return static_cast<int>(nodes_.size());
  }                                                  ///< moving bodies, fixed joints merged
  double total_mass() const { return total_mass_; }  ///< of the moving bodies [kg]
  const Vec3d& gravity() const { return gravity_; }  ///< uniform, world axes [m/s²]
  bool has_gravity() const { return gravity_.x != 0 || gravity_.y != 0 || gravity_.z != 0; }

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<JointCoordinates>& coordinates() const { return coordinates_; }
  const std::vector<BodyFrame>& bodies() const { return bodies_; }
  const std::vector<JointProperties>& joint_properties() const { return properties_; }
  /// Faults of the input that do not affect the dynamics or that the user accepted.
  const std::vector<Remark>& remarks() const { return remarks_; }
  int angle_count() const { return angles_; }

  /// The coordinate block of that name. @throws InvalidArgument naming the known ones.
  const JointCoordinates& coordinate(std::string_view name) const;
  /// The body of that name. @throws InvalidArgument naming the known ones.
  const BodyFrame& body(std::string_view name) const;

  /// q with every coordinate zero and every quaternion (1, 0, 0, 0).
  std::vector<double> neutral() const;

 private:
  friend class MechanismBuilder;
  std::string name_;
  std::vector<Node> nodes_;
  std::vector<JointCoordinates> coordinates_;
  std::vector<BodyFrame> bodies_;
  std::vector<JointProperties> properties_;
  std::vector<Remark> remarks_;
  Vec3d gravity_{0, 0, 0};
  double total_mass_ = 0;
  int nq_ = 0, nv_ = 0, angles_ = 0;
};

/// A change of the inertias of a mechanism. Empty: none.
struct InertiaChanges {
  std::vector<RigidInertia<double>> inertia_change;               ///< of each node
  std::vector<double> subtree_mass_change, rotor_inertia_change;  ///< of each; by freedom
};
/// The changes of inertias by changes of the numbers of bodies and rotors.
/// @param numbers  their changes, in the order, the units and the size of
///   FieldTangent::inertial_count()
InertiaChanges inertia_changes(const Mechanism& m, std::span<const double> numbers);

/// How inertias change along the second part of a scalar: of most they do not, but of duals over
/// lanes, the scalar of second derivatives.
template <class T>
struct ChangeOfInertias {};
template <class T>
requires phs::is_pack<T>
struct ChangeOfInertias<phs::BasicDual<T>> : InertiaChanges {
};

/// Scratch memory of the kernels for one mechanism and scalar: one per thread, allocated once.
template <class T>
struct Workspace : ChangeOfInertias<T> {
  explicit Workspace(const Mechanism& m)
      : X(m.nodes().size()),
        screw(m.nodes().size()),
        A(m.nodes().size()),
        b(m.nodes().size()),
        g(m.nodes().size()),
        a(m.nodes().size()),
        V(m.nodes().size()),
        K(static_cast<size_t>(m.nv())),
        D_inverse(static_cast<size_t>(m.nv())),
        u(static_cast<size_t>(m.nv())),
        rate(static_cast<size_t>(m.nv())),
        mu(static_cast<size_t>(m.nv())),
        turn_angle(static_cast<size_t>(m.angle_count()), T(0.0)),
        angle((turn_angle.size() + 3) / 4 * 4, T(0.0)),
        sine(angle.size()),
        cosine(angle.size()) {}

  /// Sets the turns of a state's angle blocks, which advance helical joints. Ignores excess entries
  /// of `turns`; missing entries count as zero turns (the angles then contain their turns).
  void set_turns(std::span<const std::int64_t> turns) {
    for (size_t k = 0; k < turn_angle.size(); ++k)
      turn_angle[k] = T(k < turns.size() ? double(turns[k]) * phs::two_pi_hi : 0.0);
  }

  // kinematics (place_bodies)
  std::vector<Transform<T>> X;  ///< pose of body i in its parent
  std::vector<Screw<T>> screw;  ///< of a joint about z, with its zero
  // articulated inertias (factor)
  std::vector<ArticulatedInertia<T>> A;
  std::vector<Force<T>> b;   ///< momentum or force bias
  std::vector<Force<T>> g;   ///< external wrench on the subtree
  std::vector<Motion<T>> a;  ///< accelerations
  std::vector<Motion<T>> V;  ///< twists in body frames
  std::vector<Force<T>> K;   ///< per freedom: A S D⁻¹
  std::vector<T> D_inverse, u;
  std::vector<T> rate, mu;             ///< joint rates and momenta, size nv
  std::vector<T> turn_angle;           ///< 2π·turns of each angle block
  std::vector<T> angle, sine, cosine;  ///< of each angle block, padded to whole packs
};

}  // namespace porthos::mechanics
