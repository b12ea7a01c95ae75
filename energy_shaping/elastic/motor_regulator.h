#pragma once
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "mechanics/mechanical_model.h"
#include "phs/functions/law.h"

namespace porthos::energy_shaping {

/// A joint that a motor drives through a spring, about the wanted rest.
struct SprungJoint {
  std::string port;         ///< of the joint, one number
  double theta = 0;         ///< θ_d [rad]: the spring balances the joint's load there
  double stiffness = 0;     ///< K of the spring at rest [N m/rad]
  double motor = 0;         ///< B [kg m²], at the gear's output
  double kp = 0, kd = 0;    ///< gains [N m/rad, N m s/rad]
  double limit = HUGE_VAL;  ///< of the motor's torque [N m]
};

/// Motors with springs hold a mechanism under gravity by motor positions and rates alone (Tomei
/// 1991):
///   u = g(q_d) - Kp (θ - θ_d) - Kd θ',   K (θ_d - q_d) = g(q_d)
/// shapes H_d = H - g(q_d)ᵀθ + ½ (θ - θ_d)ᵀKp(θ - θ_d), H_d' = -θ'ᵀKd θ' - friction. K and Kp must
/// exceed the curvature of gravity: the constructor checks the Hessian of H_d at rest. The link is
/// damped through the spring only.
class MotorRegulator {
 public:
  /// The loads g(q) = ∂V/∂q of the joints at rest, springs of the model included. q: size nq
  static std::vector<double> loads(const mechanics::MechanicalModel& model,
                                   const std::vector<double>& q);

  /// @param rest  q_d, nq numbers
  /// @throws InvalidArgument for constraints, joints of several degrees of freedom, gains of the
  ///   wrong sign, a load at a joint without a spring, no minimum at rest, and motions that are not
  ///   damped
  MotorRegulator(const mechanics::MechanicalModel& model, std::vector<SprungJoint> joints,
                 const std::vector<double>& rest);

  const Certificate& certificate() const { return certificate_; }
  /// The law of a motor. @param joint  its number; theta  offset of θ in the state that the law
  /// sees; the law's output y is θ'
  phs::LawPtr law(size_t joint, size_t theta) const;

 private:
  void check(const mechanics::MechanicalModel& model, const std::vector<double>& rest);

  std::vector<SprungJoint> joints_;
  std::vector<size_t> at_;    ///< coordinates of the joints
  std::vector<double> load_;  ///< g(q_d), of each joint
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
