#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
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
/// with K from the exact Jacobian of the plant's field. Fewer actuators than coordinates may do. It
/// is local, and its energy is no H_d of the mechanism: the certificate says that the linearised
/// loop is stable. falling_level() says how far.
class Lqr {
 public:
  /// @param actuators  ports, each of one number
  /// @param rest       q*, nq numbers
  /// @param periodic   angles that count modulo full turns, nq flags; empty: none
  /// @throws InvalidArgument for constraints, joints of several degrees of freedom, weights of the
  ///   wrong number or sign or that leave a motion unseen, naming its coordinates, a rest that is
  ///   no equilibrium under the actuators, and a plant that they cannot stabilise
  Lqr(std::shared_ptr<const mechanics::MechanicalModel> plant, std::vector<std::string> actuators,
      std::vector<double> rest, const LqrWeights& weights, std::vector<bool> periodic = {});

  /// Adds the condition "sampled" of held_loop.h: u is held over `period` [s] and comes `delay`
  /// periods after what it is made from. For set-up: some ms
  /// @throws InvalidArgument where it fails: it names the rate and one that would do
  void certify_sampled(double period, int delay = 0);
  const Certificate& certificate() const { return certificate_; }
  const phs::Matrix& gains() const { return K_; }           ///< m × 2n, on (q - q*, p)
  const std::vector<double>& effort() const { return u_; }  ///< u*, of each actuator
  size_t size() const { return rest_.size(); }              ///< of (q, p)
  /// The cost from here on of the linearised loop, (x - x*)ᵀ P (x - x*), with P of Riccati's
  /// equation. x: (q, p) with the turns of its angles
  double cost_to_go(std::span<const double> x) const;
  /// The largest level up to which the plant under the continuous law loses cost_to_go(): on shells
  /// that grow by a tenth, at 400 directions and at the worst ones near them, found by climbing.
  /// Between them it is not proved. 0: none. limits: as of port_laws(). For set-up
  double falling_level(const std::vector<double>& limits = {}) const;
  /// Of runs of the plant from `starts` random places where cost_to_go() is level, each periodic
  /// angle within half a turn of its rest, how many do not come to where it is below `falling`
  /// within ten of the loop's slowest time constants, whatever it does on the way. limits:
  /// as of port_laws(); period: for which the law is held [s], 0: continuous. For set-up: some ms
  /// a start
  int lost(double level, double falling, const std::vector<double>& limits = {}, double period = 0,
           int starts = 100) const;
  /// The law as controllers of the actuators. limits: largest |u| of each; empty: none.
  std::vector<PortLaw> port_laws(const std::vector<double>& limits = {}) const;

 private:
  struct Shell;
  void balance(const std::vector<int>& at);
  void design(const std::vector<int>& at, const LqrWeights& weights);
  void report_gains();
  /// Number k of x - x*. x: (q, p)
  double error(std::span<const double> x, size_t k) const;

  std::shared_ptr<const mechanics::MechanicalModel> plant_;
  std::vector<std::string> actuators_;
  std::vector<double> rest_, u_;
  std::vector<bool> periodic_;
  phs::Matrix A_, B_, K_, P_;  ///< of x' = A x + B u, u = -K x about the rest, and of the cost
  double fastest_ = 0, slowest_ = 0;  ///< time constants of the linearised loop [s]
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
