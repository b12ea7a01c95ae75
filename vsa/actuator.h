#pragma once
#include <memory>
#include <string>
#include <vector>

#include "phs/functions/function.h"
#include "phs/network/network.h"
#include "vsa/elastic.h"

/// Actuators as port-Hamiltonian systems: an elastic energy between a link and the drives of θ and
/// σ.
namespace porthos::vsa {

/// The drive of θ or σ.
struct Drive {
  enum class Kind {
    fixed,   ///< nothing: it stays at its start
    torque,  ///< a back-drivable rotor behind a gear; port effort in: torque -> rate
    /// a back-drivable rotor with a position controller: torque kp (command - angle) - kd rate.
    /// Active: its power is in the ledger
    position,
    /// not back-drivable (a worm gear); port flow in: rate -> the effort it needs, ∂E/∂θ or ∂E/∂σ
    rate,
    /// a position servo as a filter of third order without any reaction on it. Active: its power is
    /// in the ledger.   z''' = p1 (command(t) - z) - p2 z' - p3 z''
    servo
  };
  Kind kind = Kind::fixed;

  // torque, position: a rotor. Numbers on the rotor's side; the coordinate is the gear's output,
  // with `gear` rotor turns per output turn.
  double inertia =
      0;  ///< J [kg m²], > 0. Two equal motors at θ ± σ equal one of 2 J at θ and one of 2 J at σ
  double gear = 1;     ///< n; the coordinate sees n² J and n² viscous
  double viscous = 0;  ///< [N m s/rad], >= 0
  phs::FunctionPtr friction =
      nullptr;  ///< of the gear at its output, force(rate), passive; null: none
  /// L [N m] at the output: the torque is L tanh(desired / L), smooth and never above L
  double torque_limit = HUGE_VAL;
  /// [rad/s] at the output. For torque drives a brake: 0 below this rate, L at 5 % above it;
  /// requires a torque limit. For `rate` it limits the rate itself, in the way the torque is
  /// limited.
  double rate_limit = HUGE_VAL;

  /// Torque at the output [N m], rate [rad/s] or position [rad] at time t; null: none (0, or an
  /// open port).
  phs::FunctionPtr command = nullptr;
  double kp = 0, kd = 0;             ///< of `position` [N m/rad, N m s/rad]
  std::array<double, 3> p{0, 0, 0};  ///< of `servo` [1/s³, 1/s², 1/s], stable: p1 < p2 p3
};

/// Rotor motion enters only by its energy about the joint's axis, ½ n² J θ'² (Spong 1987, J. Dyn.
/// Syst. 109). The gyroscopic moment of a rotor on a moving link is neglected, as with
/// JointSpec::rotor_inertia; the rotors of rotor_body.h include it.
struct Actuator {
  ElasticPtr elastic = nullptr;
  Drive theta = {}, sigma = {};  ///< sigma: only if the energy depends on it
  double damping =
      0;  ///< parallel to the spring, between link and rotor [N m s/rad], >= 0; needs a rotor at θ
  /// Variable damper between the link and the base: torque -d(t) q', 0 <= d <= damper_limit. The
  /// ledger lists it with the controls; its work is never positive.
  phs::FunctionPtr damper = nullptr;
  double damper_limit = HUGE_VAL;  ///< [N m s/rad]
};

/// The system of an actuator, without its commands, frictions and limits, which act at its ports.
///   x = (link, θ, σ, momentum of θ, momentum of σ, servos' rates and accelerations), as far as
///   they exist
///   H = E(link, θ, σ) + Σ p²/(2 n² J)
/// The state has its own link angle: unwrapped, and equal to the joint's angle by a Casimir. Use
/// actuator_start for the start. Ports: "link" (flow in: joint rate -> ∂E/∂q), "theta" and "sigma"
/// according to their drives.
/// @throws InvalidArgument for no elastic energy, a rotor without inertia, a σ drive without a σ,
/// or an invalid number
std::shared_ptr<const phs::Model> actuator_model(const Actuator& a);

/// The start value of that state, at rest. link: the angle of the joint at the start [rad], from
/// which it never moves apart. `who` begins the error texts.
/// @throws InvalidArgument as Elastic::require_inside
std::vector<double> actuator_start(const std::string& who, const Actuator& a, double link,
                                   double theta, double sigma);

/// What friction, brake and the damper beside the spring exert on the rotor of θ or, `second`, of
/// σ, at the gear's output [N m], at its rate and that of the link [rad/s]; 0 without a rotor.
double rotor_losses(const Actuator& a, bool second, double rate, double link_rate);

/// What the command of a torque drive or the controller of a position drive exerts at the gear's
/// output [N m], behind its limit; 0 of other drives. angle, rate: at the output [rad, rad/s].
double drive_torque(const Drive& d, double t, double angle, double rate);

/// The rate that a drive of kind `rate` gives its coordinate at time t [rad/s], behind its limit; 0
/// of other drives, and without a command.
double drive_rate(const Drive& d, double t);

/// Adds an actuator `name` to a network and joins it to an effort_in port of a joint
/// ("<member>.<joint>.torque"), with its commands, frictions and limits. Ledger: storages
/// "<name>.spring", "<name>.rotor", "<name>.sigma_rotor"; works by drive "<name>.theta.torque",
/// ".controller", ".rate" or ".servo", losses "<name>.theta.viscous", ".friction", ".brake", the
/// same of "<name>.sigma", the loss "<name>.damping"; "<name>.damper" is among the works, as it is
/// commanded. A drive of kind torque or rate without a command has no work and leaves its port
/// ("<name>.theta") open for a controller.
/// @throws InvalidArgument as actuator_model()
void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const Actuator& a);

/// The same, with the rotor of θ as a body of the mechanism (add_rotor() of rotor_body.h), so that
/// its gyroscopic moment is included. `rotor_port`: "<member>.<joint>_rotor.torque". a.theta must
/// be a torque drive with inertia 0, because the body has the inertia. Gear, friction, limits and
/// command are those of the drive. θ' is the rotor's rate divided by the gear ratio; θ - angle /
/// gear is constant. Without a command the rotor's port stays open, for torques on the rotor's
/// side. Storages: "<name>.spring" and those of σ; the rotor's energy belongs to the mechanism.
/// @throws InvalidArgument as actuator_model(), for another drive or an inertia at θ
void attach(phs::Network& n, const std::string& name, const std::string& joint_port,
            const std::string& rotor_port, const Actuator& a);

}  // namespace porthos::vsa
