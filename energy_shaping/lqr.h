#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/certificate.h"
#include "energy_shaping/port_law.h"
#include "mechanics/mechanical_model.h"
#include "phs/linear_algebra/matrix.h"

namespace porthos::energy_shaping {

/// Weights of the cost ∫ Σ position (q - q*)² + Σ rate q'² + Σ effort (u - u*)² dt.
struct LqrWeights {
  std::vector<double> position, rate;  ///< of each coordinate, 0 or more
  std::vector<double> effort;          ///< of each actuator, more than 0
};

/// The linear-quadratic regulator of a mechanism about an equilibrium (Kalman 1960):
///   u = u* - K (x - x*),  x = (q, p)
/// with K from the exact Jacobian of the plant's field. It needs fewer actuators than coordinates
/// only; it is local, and its energy is no H_d of the mechanism: the certificate says that the
/// linearised loop is stable, nothing of its basin.
class Lqr {
 public:
  /// @param actuators  ports, each of one number
  /// @param rest       q*, nq numbers
  /// @throws InvalidArgument for constraints, joints of several degrees of freedom, weights of the
  ///   wrong number or sign, a rest that is no equilibrium under the actuators, and a plant that
  ///   they cannot stabilise
  Lqr(std::shared_ptr<const mechanics::MechanicalModel> plant, std::vector<std::string> actuators,
      std::vector<double> rest, const LqrWeights& weights);

  const Certificate& certificate() const { return certificate_; }
  const phs::Matrix& gains() const { return K_; }           ///< m × 2n, on (q - q*, p)
  const std::vector<double>& effort() const { return u_; }  ///< u*, of each actuator
  /// The law as controllers of the actuators. limits: largest |u| of each; empty: none.
  std::vector<PortLaw> port_laws(const std::vector<double>& limits = {}) const;

 private:
  void balance(const std::vector<int>& at);
  void design(const std::vector<int>& at, const LqrWeights& weights);

  std::shared_ptr<const mechanics::MechanicalModel> plant_;
  std::vector<std::string> actuators_;
  std::vector<double> rest_, u_;
  phs::Matrix K_;
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
