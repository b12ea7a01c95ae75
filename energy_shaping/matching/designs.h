#pragma once
#include <optional>

#include "energy_shaping/matching/matched_loop.h"

/// Ready-made designs with closed forms. Each function checks the design's own conditions (with a
/// message if one fails). Then MatchedLoop checks the matching, the masses and the Hessian
/// numerically over a region.
///
/// If no plant is given, it is the design's own, from formulas. If one is given, for example a
/// MechanicalModel, the same law is matched to it: the conditions then hold for that plant, or the
/// constructor says which does not.
namespace porthos::energy_shaping {

using LoopPtr = std::shared_ptr<const MatchedLoop>;
using PlantPtr = std::shared_ptr<const phs::Model>;

/// Inertia-wheel pendulum: q1 the pendulum from upright, q2 with M = diag(I1, I2), V = m3 cos q1, G
/// = (-1, 1). Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002. The gain kp = 3.75 published
/// there for the numbers below is k1 = 0.1 here.
struct InertiaWheelPendulum {
  /// Of the pendulum about its pivot with the wheel's mass at its axis, J + m_w l_w² [kg m²]
  double I1 = 0.1;
  double I2 = 0.2;  ///< of the wheel about its axis [kg m²]
  double m3 = 10;  ///< no mass: m g l of pendulum and wheel, the torque of gravity when level [N m]
  double a1 = 1, a2 = -1.5, a3 = 6;  ///< M_d = [[a1, a2], [a2, a3]]
  double k1 = 0.1;                   ///< of ½ z² in V_d, z = q2 - I1 (a2 + a3)/(I2 (a1 + a2)) q1
  double kv = 10;                    ///< damping injected, -kv Gᵀ ∂H_d/∂p
};
/// The same pendulum with the gains by which the linearised loop has the poles of
/// (s² + 2ζω s + ω²)². A constant M_d reaches every stable polynomial s⁴ + c3 s³ + c2 s² + c1 s +
/// c0: with α = -(a1 + a2), u = κ (γ q1 + q2) - m3 a2/α q1 + δ ((a2 + a3) I1 q1' + α I2 q2'), which
/// is compared with the feedback of these poles; a1 > 0 and a1 a3 > a2² are Hurwitz's conditions.
/// @param bandwidth  ω [rad/s] @param damping_ratio  ζ
/// @throws InvalidArgument unless all numbers and both are above 0
InertiaWheelPendulum inertia_wheel_gains(InertiaWheelPendulum d, double bandwidth,
                                         double damping_ratio);
PlantPtr inertia_wheel_plant(const InertiaWheelPendulum& d);
/// @throws InvalidArgument unless a1 > 0, a1 a3 > a2², a1 + a2 < 0
LoopPtr inertia_wheel_pendulum(const InertiaWheelPendulum& d, PlantPtr plant = nullptr,
                               std::optional<MatchingOptions> options = {});

/// Ball and beam: q1 the ball from the middle, q2 the beam, M = diag(1, L² + q1²), V = g q1 sin q2,
/// torque on the beam. Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002, section VI.
struct BallAndBeam {
  double L = 1;     ///< √(J/m), J of beam and ball about the hinge, the ball there [m]
  double g = 9.81;  ///< acceleration of gravity along the beam when upright [m/s²]
  double kp = 5;    ///< of ½ z² in V_d, z = q2 - asinh(q1/L)/√2
  double kv = 3;    ///< damping injected, -kv Gᵀ ∂H_d/∂p
};
PlantPtr ball_and_beam_plant(const BallAndBeam& d);
LoopPtr ball_and_beam(const BallAndBeam& d, PlantPtr plant = nullptr,
                      std::optional<MatchingOptions> options = {});

/// Cart-pole after partial feedback linearisation: q1 the pole from upright, q2 the cart, M = I, V
/// = a cos q1,
/// G = (-b cos q1, 1); a = g/l, b = 1/l. Holds for |q1| < π/2; the cart may stop anywhere
/// (q2_rest). Source: Acosta, Ortega, Astolfi, Mahindrakar 2005, section IV.
struct CartPole {
  double a = 10;       ///< m g l/J of the pole, J about its hinge; of a point mass g/l [1/s²]
  double b = 1;        ///< m l/J of the pole; of a point mass 1/l [1/m]
  double k = 1;        ///< scale of M_d, and 1/k of the pole's part of V_d
  double m22 = 0.1;    ///< the constant part of (M_d)_22 = k cos q1 + m22
  double P = 1;        ///< of ½ z² in V_d, z = q2 - q2_rest + a function of q1
  double kv = 3;       ///< damping injected, -kv Gᵀ ∂H_d/∂p
  double q2_rest = 0;  ///< where the cart is to stop [m]
};
PlantPtr cart_pole_plant(const CartPole& d);
/// @throws InvalidArgument unless a, b, k, m22, P > 0
LoopPtr cart_pole(const CartPole& d, PlantPtr plant = nullptr,
                  std::optional<MatchingOptions> options = {});

/// Acrobot: q1 the shoulder from upright, q2 the elbow, torque at the elbow,
///   M = [[c1 + c2 + 2 c3 cos q2, c2 + c3 cos q2], [·, c2]],  V = g (c4 cos q1 + c5 cos(q1 + q2)).
/// M_d is constant. V_d is quasi-periodic, so that the rest point is a local minimum only: mind the
/// basin. Source: Mahindrakar, Astolfi, Ortega, Viola 2006.
struct Acrobot {
  // m, J: of each link, J about its centre of mass; l1: from shoulder to elbow; lc: from each
  // link's joint to its centre of mass
  double c1 = 2.3333;     ///< J1 + m1 lc1² + m2 l1² about the shoulder [kg m²]
  double c2 = 5.3333;     ///< J2 + m2 lc2² about the elbow [kg m²]
  double c3 = 2;          ///< m2 l1 lc2 [kg m²]
  double c4 = 3;          ///< m1 lc1 + m2 l1 [kg m]
  double c5 = 2;          ///< m2 lc2 [kg m]
  double g = 9.8;         ///< acceleration of gravity [m/s²]
  double a2 = 1, a3 = 4;  ///< M_d = [[k a2, a2], [a2, a3]], k = 1 - √(c1/c2)
  double ku = 200;        ///< of ½ z² in V_d, z = q2 + (1 + √(c1/c2)) q1
  double kv = 2;          ///< damping injected, -kv Gᵀ ∂H_d/∂p

  /// The same numbers read off a plant with coordinates (shoulder from upright, elbow).
  static Acrobot of(const phs::Model& plant, double g = 9.81);
};
/// The plant with those numbers.
PlantPtr acrobot_plant(const Acrobot& d);
/// @throws InvalidArgument unless c2 > c1, a2 > 0, a3 > a2/k, c4 > √(c1/c2) c5
LoopPtr acrobot(const Acrobot& d, PlantPtr plant = nullptr,
                std::optional<MatchingOptions> options = {},
                const std::string& elbow_port = "elbow.force");

/// Strongly coupled VTOL aircraft after an input change: x, y, θ with M = I, V = (g/ε) cos θ and
/// G = [[1, 0], [0, 1], [cos θ, sin θ]/ε]. Source: Acosta, Ortega, Astolfi, Mahindrakar 2005,
/// section V.
struct Vtol {
  double epsilon = 0.5;            ///< J/(m h), h from the centre of mass down to the engine [m]
  double g = 9.8;                  ///< acceleration of gravity [m/s²]
  double k1 = 2, k2 = 3, k3 = 12;  ///< M_d
  double P = 0.1;                  ///< of ½ (z1² + z2²) in V_d, z: place less functions of θ
  double kv = 10;                  ///< damping injected, -kv Gᵀ ∂H_d/∂p
  double x_rest = 0, y_rest = 0;   ///< where it is to hover [m]
};
PlantPtr vtol_plant(const Vtol& d);
/// @throws InvalidArgument unless k3 > 5 k1 ε, k1/ε > k2 > k1/(2ε), P > 0
LoopPtr vtol(const Vtol& d, PlantPtr plant = nullptr, std::optional<MatchingOptions> options = {});

}  // namespace porthos::energy_shaping
