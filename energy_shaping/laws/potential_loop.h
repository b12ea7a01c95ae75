#pragma once
#include <optional>
#include <string>
#include <vector>

#include "energy_shaping/loop/closed_loop.h"
#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// A spring at a joint of one degree of freedom: U = ½ k (q - rest)², or k (1 - cos(q - rest)),
/// which cannot unwind.
struct JointSpring {
  std::string port;  ///< "shoulder.torque"
  double stiffness = 0, rest = 0;
  bool periodic = false;
};

/// A spring between a body and the world, for the position of a link's point and for its attitude:
///   U = ½ k |r - position|² + tr(A (1 - R_dᵀR)),  A = diag(a)
/// The trace potential is smooth on all of SO(3), one value for a quaternion and its negative: it
/// never unwinds. Its critical points are R_d and three half turns away from it, with U = 2 (a_j +
/// a_k) there (after Koditschek 1989, Bullo, Lewis 2004); near a half turn the moment is small.
/// With a = k/2 each, U = k (1 - cos angle).
struct PoseSpring {
  std::string link;
  mechanics::Vec3d point{0, 0, 0};               ///< in the link's frame [m]
  double stiffness = 0;                          ///< k [N/m]
  mechanics::Vec3d position{0, 0, 0};            ///< in the world [m]
  mechanics::Vec3d attitude_stiffness{0, 0, 0};  ///< a [N m]
  mechanics::Mat3<double> attitude = mechanics::Mat3<double>::identity();  ///< R_d
};

/// Damping -d y at a port, on each of its numbers.
struct PortDamping {
  std::string port;
  std::vector<double> damping;  ///< one number for all, or one each
};

/// The desired potential and damping of a mechanism.
struct PotentialShaping {
  std::string name = "potential shaping";
  std::vector<JointSpring> joints;
  std::vector<PoseSpring> poses;
  std::vector<PortDamping> damping;
  /// Compensates the plant's own potential (gravity, joint springs), so that H_d = T + U; refused
  /// where it acts at a joint without actuator. Otherwise it stays in H_d.
  bool compensate = true;
  /// A constant generalised force at the actuators balances the plant's potential at the rest
  /// point, instead of compensation: PD with constant gravity (Takegaki, Arimoto 1981). Needs a
  /// stiffness above the plant's Hessian.
  bool constant_compensation = false;
  /// Ports with an actuator; empty: every joint port.
  std::vector<std::string> actuators;
  /// For a base that floats without actuators: the loop is that of total momentum zero, in which
  /// the base follows the joints, v_b = -M_bb⁻¹M_bj v_j. Joint torques can then realise springs
  /// that depend on its pose: τ = -J*ᵀ∂U (J* the generalised Jacobian, Umetani, Yoshida 1989). The
  /// momentum is a Casimir of the loop. Needs one free root and joints of one degree of freedom.
  bool zero_momentum = false;
  std::vector<double> rest;  ///< rest coordinates, nq numbers
  /// `rest` is a guess: the nearest minimum of V_d is searched by Newton's method.
  bool search_rest = false;
  double tolerance = 1e-9;  ///< of forces no actuator can make, and of the rest point
};

/// A mechanism with potential shaping and damping injection: the plant's own structure with
///   H_d = H + U (- V),  R_d = R + G Kd Gᵀ,  u = -∂U - Kd y
/// where U needs G⊥∂U = 0: a force that the actuators cannot make is found and refused. With
/// zero_momentum J_d is that of the reduced system, and the plant moves as the target if the total
/// momentum is 0.
///
/// (The law with the opposite sign of ∂U and the plant's damping subtracted again, met in
/// textbooks, makes a saddle.) Cost of a field: two of the plant, the kinematics, and a mass matrix
/// with zero_momentum.
class PotentialLoop : public ClosedLoopFor<PotentialLoop> {
 public:
  /// @throws InvalidArgument naming the port, link or number at fault, a force that no actuator can
  /// make with the worst coordinates, or a point that is not a rest point
  PotentialLoop(std::shared_ptr<const mechanics::MechanicalModel> plant, PotentialShaping shaping);

  const phs::Description& description() const override { return description_; }
  const mechanics::MechanicalModel& mechanical() const { return *mechanical_; }
  template <class T>
  std::unique_ptr<LoopSystem<T>> make_loop() const;

  /// The shaping, looked up in the mechanism.
  struct Parts {
    struct Spring {
      size_t q, v;
      double stiffness, rest;
      bool periodic;
    };
    struct Pose {
      mechanics::BodyFrame frame;
      PoseSpring spring;
    };
    std::vector<Spring> joints;
    std::vector<Pose> poses;
    std::vector<double> damping;   ///< nv
    std::vector<double> constant;  ///< nv: constant generalised force
    std::vector<bool> actuated;    ///< nv
    bool compensate = false, zero_momentum = false;
    size_t base_q = 0, base_v = 0;  ///< of the free root
  };
  const Parts& parts() const { return parts_; }
  /// Joints of one degree of freedom that have neither stiffness nor actuator: nothing holds them.
  const std::vector<std::string>& free_joints() const { return free_; }

 private:
  void check(const PotentialShaping& shaping);
  void search_rest();

  std::shared_ptr<const mechanics::MechanicalModel> mechanical_;
  Parts parts_;
  std::vector<std::string> free_;
  phs::Description description_;
};

}  // namespace porthos::energy_shaping
