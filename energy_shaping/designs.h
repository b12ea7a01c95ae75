#pragma once
#include <optional>

#include "energy_shaping/matched_loop.h"

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
  double I1 = 0.1, I2 = 0.2, m3 = 10;  ///< [kg m²], [kg m²], [N m]
  double a1 = 1, a2 = -1.5, a3 = 6;    ///< M_d = [[a1, a2], [a2, a3]]
  double k1 = 0.1, kv = 10;
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
  double L = 1, g = 9.81;
  double kp = 5, kv = 3;
};
PlantPtr ball_and_beam_plant(const BallAndBeam& d);
LoopPtr ball_and_beam(const BallAndBeam& d, PlantPtr plant = nullptr,
                      std::optional<MatchingOptions> options = {});

/// Cart-pole after partial feedback linearisation: q1 the pole from upright, q2 the cart, M = I, V
/// = a cos q1,
/// G = (-b cos q1, 1); a = g/l, b = 1/l. Holds for |q1| < π/2; the cart may stop anywhere
/// (q2_rest). Source: Acosta, Ortega, Astolfi, Mahindrakar 2005, section IV.
struct CartPole {
  double a = 10, b = 1;
  double k = 1, m22 = 0.1, P = 1, kv = 3;
  double q2_rest = 0;
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
  double c1 = 2.3333, c2 = 5.3333, c3 = 2, c4 = 3, c5 = 2, g = 9.8;
  double a2 = 1, a3 = 4;  ///< M_d = [[k a2, a2], [a2, a3]], k = 1 - √(c1/c2)
  double ku = 200, kv = 2;

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
  double epsilon = 0.5, g = 9.8;
  double k1 = 2, k2 = 3, k3 = 12;  ///< M_d
  double P = 0.1, kv = 10;
  double x_rest = 0, y_rest = 0;
};
PlantPtr vtol_plant(const Vtol& d);
/// @throws InvalidArgument unless k3 > 5 k1 ε, k1/ε > k2 > k1/(2ε), P > 0
LoopPtr vtol(const Vtol& d, PlantPtr plant = nullptr, std::optional<MatchingOptions> options = {});

}  // namespace porthos::energy_shaping
