#pragma once
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "phs/functions/function.h"
#include "phs/system/system.h"

/// Elements that close or join the ports of a Network: resistive laws, potentials, sources, and
/// small systems with a state. Quantities are SI. "rate" and "force" stand for the flow and effort
/// of the port.
namespace porthos::phs {

// --- resistive laws: force = law(rate), with rate · law(rate) >= 0 -------------------------------

/// force = damping · rate, damping in [N s/m | N m s/rad].
/// @throws InvalidArgument if damping < 0 or is not finite
FunctionPtr viscous(double damping);

/// Dry friction with the Stribeck effect, smoothed: the force rises to its breakaway value within
/// about `smoothing` of rest, so it cannot hold a load at rest. Passive by construction, because
/// force and rate have the same sign.
///   force = (coulomb + (breakaway - coulomb) exp(-(rate/stribeck)²)) tanh(rate/smoothing)
///           + viscous · rate
/// Source: after Armstrong-Helouvry, Dupont, Canudas de Wit 1994, survey, model of section 2.1,
/// with tanh for the sign.
struct Friction {
  double coulomb = 0;    ///< [N | N m]
  double breakaway = 0;  ///< >= coulomb
  double stribeck = 0;   ///< [m/s | rad/s], > 0 where breakaway > coulomb
  double viscous = 0;    ///< [N s/m | N m s/rad]
  double smoothing = 0;  ///< [m/s | rad/s], > 0
};
/// @throws InvalidArgument naming the number that is out of range
FunctionPtr friction(const Friction& f);

/// Dry friction by a bristle that bends before it slips: it holds a load at rest like a spring, and
/// breaks loose at less force the faster the load grows. The bend z is a state; see Network::lugre.
///   z' = v - σ0 |v| z / g(v),   force = σ0 z + σ1 z' + σ2 v
///   g(v) = coulomb + (breakaway - coulomb) exp(-(v/stribeck)²)
/// It stores σ0 z²/2. With that energy it is passive for every motion if, and only if,
/// σ2 >= σ1 (breakaway - coulomb) / coulomb.
/// Source: Canudas de Wit, Olsson, Astrom, Lischinsky 1995; the condition: Barabanov, Ortega 2000.
struct LuGre {
  double coulomb = 0;            ///< [N | N m], > 0
  double breakaway = 0;          ///< >= coulomb; 0: coulomb
  double stribeck = 0;           ///< [m/s | rad/s], > 0 where breakaway > coulomb
  double viscous = 0;            ///< σ2 [N s/m | N m s/rad], >= 0
  double bristle_stiffness = 0;  ///< σ0 [N/m | N m/rad], > 0
  double bristle_damping = 0;    ///< σ1 [N s/m | N m s/rad], >= 0
};
/// @throws InvalidArgument naming the number that is out of range, and what is not passive
void check(const LuGre& f);

// --- potentials of one coordinate ----------------------------------------------------------------

/// U = ½ k (z - rest)² + ¼ k3 (z - rest)⁴. @throws InvalidArgument if k < 0 or k3 < 0, where U
/// would have no minimum
Potential spring(double k, double rest = 0, double k3 = 0);
/// A measured spring: forces at some elongations z. Between them a natural cubic spline (force and
/// its slope continuous), outside linear.
/// @throws InvalidArgument unless z and force are finite, of one length >= 2, and z rises
Potential tabulated_spring(const std::vector<double>& z, const std::vector<double>& force);
/// U = ⅓ k d³, d the depth beyond a limit: U'' is continuous, and there is no force between the
/// limits.
/// @throws InvalidArgument unless lower < upper and k > 0
Potential soft_limits(double lower, double upper, double k);

// --- sources: v(t) -------------------------------------------------------------------------------

/// v(t) = value, in the unit of the port. @throws InvalidArgument unless it is finite
FunctionPtr constant(double value);
/// offset + amplitude · sin(2π frequency_Hz t + phase), amplitude and offset in the unit of the
/// port, t [s], phase [rad]. @throws InvalidArgument unless all are finite
FunctionPtr sine(double amplitude, double frequency_Hz, double phase = 0, double offset = 0);
/// Values at times t: a natural cubic spline between them, outside the first and last value.
/// @throws InvalidArgument as tabulated_spring()
FunctionPtr profile(const std::vector<double>& t, const std::vector<double>& value);

/// A value that stays constant until it is set again: the zero-order hold of a sampled controller.
/// Use one object per run, and set it between steps only.
class Held {
 public:
  Held();
  void set(double value) { *value_ = value; }
  double value() const { return *value_; }
  FunctionPtr signal() const;

 private:
  std::shared_ptr<double> value_;
};

// --- systems with a state ------------------------------------------------------------------------

/// Units of a port: of its flow (rate), its effort, and their integrals.
struct Domain {
  const char *flow, *effort, *displacement, *momentum;
};
inline constexpr Domain translation{"m/s", "N", "m", "kg m/s"};
inline constexpr Domain rotation{"rad/s", "N m", "rad", "kg m^2/s"};
inline constexpr Domain electricity{"A", "V", "C", "V s"};

/// State: elongation z, z' = rate. Port "ends" (flow in): rate -> force U'(z). A capacitor in the
/// electrical domain.
std::shared_ptr<const Model> spring_element(const Potential& potential, const Domain& d = rotation);
/// State: momentum p, p' = force. Port "body" (effort in): force -> rate p/m. An inductor in the
/// electrical domain.
/// @throws InvalidArgument unless mass > 0
std::shared_ptr<const Model> inertia_element(double mass, const Domain& d = rotation);

/// Direct-current motor with torque k i and back-emf k ω.
struct DcMotor {
  double inductance = 0;     ///< L [H], > 0
  double resistance = 0;     ///< R [Ohm], >= 0
  double constant = 0;       ///< k [N m/A = V s/rad]
  double gear = 1;           ///< rotor turns per turn of the shaft
  double rotor_inertia = 0;  ///< [kg m²] on the rotor's side; see the two models
  double friction = 0;       ///< viscous [N m s/rad] on the rotor's side, >= 0
};
/// A motor with its rotor. States: flux L i, momentum of the rotor as seen at the shaft. Ports
/// "supply" (effort in: V -> A) and "shaft" (effort in: N m -> rad/s). Connect it to a joint
/// through a spring, or use it alone.
std::shared_ptr<const Model> dc_motor(const DcMotor& m);
/// A motor on a rigid gear, without a rotor of its own. Give gear² · rotor_inertia to the joint as
/// its rotor inertia; dc_drive ignores rotor_inertia. State: flux. Ports "supply" and "shaft" (flow
/// in: rad/s -> the reaction torque - gear k i), for Network::feedback with a joint. Give the rotor
/// friction to the joint as damping: gear² · friction.
std::shared_ptr<const Model> dc_drive(const DcMotor& m);

}  // namespace porthos::phs
