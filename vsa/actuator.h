#pragma once
#include <memory>
#include <string>
#include <vector>

#include "phs/functions/function.h"
#include "phs/network/network.h"
#include "vsa/elastic.h"

/// Actuators as port-Hamiltonian systems: an elastic energy between a link and what moves θ and σ.
namespace porthos::vsa {

/// What moves θ or σ.
struct Drive {
  enum class Kind {
    fixed,   ///< nothing: it stays where it starts
    torque,  ///< a back-drivable rotor behind a gear; port effort in: torque -> rate
    /// the same, its torque by a controller: kp (command - angle) - kd rate. Active: its power is
    /// in the ledger
    position,
    /// not back-drivable (a worm gear): port flow in: rate -> the effort it takes, ∂E/∂θ or ∂E/∂σ
    rate,
    /// a position servo as a filter of third order that nothing drives back. Active, its power is
    /// in the ledger:   z''' = p1 (command(t) - z) - p2 z' - p3 z''
    servo
  };
  Kind kind = Kind::fixed;

  // torque, position: a rotor. Numbers on the rotor's side; the coordinate is the gear's output,
  // `gear` turns to one.
  double inertia =
      0;  ///< J [kg m²], > 0. Two equal motors at θ ± σ are one of 2 J at θ and one of 2 J at σ
  double gear = 1;     ///< n; the coordinate sees n² J and n² viscous
  double viscous = 0;  ///< [N m s/rad], >= 0
  phs::FunctionPtr friction =
      nullptr;  ///< of the gear at its output, force by rate, passive; null: none
  /// L [N m] at the output: the torque is L tanh(wish / L), smooth, and never beyond L
  double torque_limit = HUGE_VAL;
  /// [rad/s] at the output, for torques a brake: 0 below, L where the rate is 5 % above; needs a
  /// torque limit. For `rate` the rate itself, as the torque is limited.
  double rate_limit = HUGE_VAL;

  /// Torque at the output [N m], rate [rad/s] or position [rad] at time t; null: none (0, or an
  /// open port).
  phs::FunctionPtr command = nullptr;
  double kp = 0, kd = 0;             ///< of `position` [N m/rad, N m s/rad]
  std::array<double, 3> p{0, 0, 0};  ///< of `servo` [1/s³, 1/s², 1/s], stable: p1 < p2 p3
};

/// Rotors turn about the joint's axis only in what concerns their energy, ½ n² J θ'² (Spong 1987,
/// J. Dyn. Syst. 109): the gyroscopic moment of a rotor that is carried round is neglected, as that
/// of JointSpec::rotor_inertia; rotor_body.h has rotors that do without this.
struct Actuator {
  ElasticPtr elastic = nullptr;
  Drive theta = {}, sigma = {};  ///< sigma: only where the energy depends on it
  double damping =
      0;  ///< beside the spring, between link and rotor [N m s/rad], >= 0; asks for a rotor at θ
  /// Variable damper between the link and the base: torque -d(t) q', 0 <= d <= damper_limit. In the
  /// ledger under the controls, as work that is never positive.
  phs::FunctionPtr damper = nullptr;
  double damper_limit = HUGE_VAL;  ///< [N m s/rad]
};

/// The system of an actuator, without its commands, frictions and limits, which act at its ports.
///   x = (link, θ, σ, momentum of θ, momentum of σ, servos' rates and accelerations), as far as
///   there are such
///   H = E(link, θ, σ) + Σ p²/(2 n² J)
/// The link's angle is a number of its own: unwrapped, and equal to the joint's by a Casimir. Start
/// it with actuator_start. Ports: "link" (flow in: joint rate -> ∂E/∂q), "theta" and "sigma" by
/// their drives.
/// @throws InvalidArgument: no elastic energy, a rotor without inertia, a σ drive where there is no
///   σ, a bad number
std::shared_ptr<const phs::Model> actuator_model(const Actuator& a);

/// The start of that state, at rest. `who` begins the sentences.
/// @throws InvalidArgument as Elastic::require_inside
std::vector<double> actuator_start(const std::string& who, const Actuator& a, double link,
                                   double theta, double sigma);

/// Adds an actuator `name` to a network and joins it to an effort_in port of a joint
/// ("<member>.<joint>.torque"), with its commands, frictions and limits. Ledger: storages
/// "<name>.spring", "<name>.rotor", "<name>.sigma_rotor"; works "<name>.theta", "<name>.sigma" of
/// what is commanded, "<name>.theta.friction", ... A drive of kind torque or rate without a command
/// leaves its port open ("<name>.theta") for a controller.
/// @throws InvalidArgument as actuator_model()
void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const Actuator& a);

/// The same with the rotor of θ a body of the mechanism (add_rotor() of rotor_body.h), whose
/// gyroscopic moment is then no longer neglected. `rotor_port`: "<member>.<joint>_rotor.torque".
/// a.theta is a drive by torque whose inertia is 0, as the body has it; gear, friction, limits and
/// command are its own. θ' is the rotor's rate over the gear; θ - angle / gear stays. Without a
/// command the rotor's port stays open, for torques on the rotor's side. Storages: "<name>.spring"
/// and those of σ; the rotor's energy is the mechanism's.
/// @throws InvalidArgument as actuator_model(), for another drive or an inertia at θ
void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const std::string& rotor_port, const Actuator& a);

}  // namespace porthos::vsa
