#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "mechanics/mechanical_model.h"
#include "phs/functions/law.h"

namespace porthos::energy_shaping {

/// A joint that a motor drives through a linear spring, and what the law makes of it.
struct PreservedJoint {
  std::string port;                    ///< of the joint, one number
  double stiffness = 0;                ///< K of the spring [N m/rad], > 0
  double motor = 0;                    ///< B [kg m²], at the gear's output, > 0
  double rest = 0;                     ///< q_d [rad]
  double link_damping = 0;             ///< D, at the link [N m s/rad], >= 0
  double gain = 0, motor_damping = 0;  ///< Ke > 0 [N m/rad], De >= 0 [N m s/rad]
};

/// Elastic-structure-preserving regulation and link damping (Keppler, Lakatos, Ott, Albu-Schäffer
/// 2018) of a mechanism with a motor and a linear spring at each joint: the law of
/// ElasticStructurePreserving with accelerations and jerks from the model. With n = ∂V/∂q - D q'
/// and η = θ - K⁻¹n
///   u = n + B K⁻¹n'' - Ke (η - q_d) - De η'
/// leaves  M q'' + C q' = K (η - q) - (D + D0) q',  B η'' = K (q - η) - Ke (η - q_d) - De η': no
/// gravity, and damping at the links, which motors behind springs cannot make otherwise. H_d = T +
/// ½ (η-q)ᵀK(η-q) + ½ η'ᵀB η' + ½ |η - q_d|²_Ke. D0: the damping of the model's joints. Forces the
/// model does not have (contacts, friction of elements) act on both, and η then has errors of their
/// rates.
class StructurePreservingRegulator {
 public:
  /// Every joint of the mechanism, in any order.
  /// @throws InvalidArgument for constraints, joints of several degrees of
  /// freedom, a joint without
  ///   a motor, numbers out of range, and motions that are not damped
  StructurePreservingRegulator(std::shared_ptr<const mechanics::MechanicalModel> model,
                               std::vector<PreservedJoint> joints);

  const Certificate& certificate() const { return certificate_; }
  /// Where a motor's θ and its momentum B θ' are in the state that the laws see.
  struct MotorPlace {
    size_t theta, momentum;
  };
  /// The law of each motor, in the order of the joints given; they share one evaluation. The state
  /// they see begins with that of the mechanism. Cost: that of LinkMotion.
  std::vector<phs::LawPtr> laws(const std::vector<MotorPlace>& motors) const;

  /// What it was made of; numbers per coordinate.
  struct Parts {
    std::shared_ptr<const mechanics::MechanicalModel> model;
    std::vector<double> K, B, rest, D, Ke, De;
  };

 private:
  void certify();
  void check_motion();

  std::shared_ptr<const Parts> parts_;
  std::vector<size_t> at_;  ///< coordinate of each joint given
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
