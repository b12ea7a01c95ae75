#pragma once
#include <vector>

#include "vsa/elastic.h"

/// The families of variable-stiffness actuators, each given by one energy. φ = q - θ [rad]. K(0) is
/// the stiffness at φ = 0. Every maker takes the parameters and the limits. @throws InvalidArgument
/// naming a parameter out of range
namespace porthos::vsa {

/// A spring between gear and link, hardening with k3: E = ½ k φ² + ¼ k3 φ⁴. No σ.
/// Source: Pratt, Williamson 1995, IROS.
struct SeriesElastic {
  double k;       ///< [N m/rad], >= 0
  double k3 = 0;  ///< [N m/rad³], >= 0
};
ElasticPtr series_elastic(const SeriesElastic& p, const Limits& l = {});

/// Any lever mechanism, given by its stiffness: E = ½ k(σ) φ², k(σ) = Σ k_i σⁱ, which must be >= 0
/// over the range of σ.
struct VariableLever {
  std::array<double, 4> k;  ///< [N m/rad / σⁱ]
};
ElasticPtr variable_lever(const VariableLever& p, const Limits& l);

/// Two tendons with quadratic springs F = ks d², on pulleys of radius r, pretensioned by σ. A
/// tendon only pulls:
///   E = ⅓ ks r³ [max(σ + φ, 0)³ + max(σ - φ, 0)³],   K = 4 ks r³ σ while both are taut: a linear
///   spring.
/// Source: Migliore, Brown, DeWeerth 2005, ICRA.
struct AntagonisticQuadratic {
  double ks;  ///< [N/m²], > 0
  double r;   ///< [m], > 0
};
ElasticPtr antagonistic_quadratic(const AntagonisticQuadratic& p, const Limits& l = {});

/// Two springs F = c (exp(b d) - 1): E = (c/b) Σ (exp(b d) - b d - 1), d = σ ± φ; K(0) = 2 b c
/// exp(b σ).
struct AntagonisticExponential {
  double c;  ///< [N m], > 0
  double b;  ///< [1/rad], > 0
};
ElasticPtr antagonistic_exponential(const AntagonisticExponential& p, const Limits& l = {});

/// Two springs k sinh(a d) towards motors at θ ± σ, as in VSA-Cube and qbmove:
///   E = (k1/a1) [cosh a1(φ - σ) - 1] + (k2/a2) [cosh a2(φ + σ) - 1].
/// With two equal springs K = 2 a k cosh(aσ) cosh(aφ). The deflection limit is that of each spring,
/// |φ ± σ|. Source: after Catalano et al. 2011, ICRA (VSA-Cube).
struct Cosh {
  double a, k;            ///< [1/rad], [N m], > 0
  double a2 = 0, k2 = 0;  ///< of the second spring; 0: like the first
};
ElasticPtr cosh_springs(const Cosh& p, const Limits& l = {});

/// Two springs at the end of a lever of length σ: E = ks σ² sin²φ, K(0) = 2 ks σ².
/// Source: after Jafari et al. 2010, IROS (AwAS).
struct LeverArm {
  double ks;  ///< of one spring [N/m], > 0
};
ElasticPtr lever_arm(const LeverArm& p, const Limits& l = {});

/// A lever of length L with its pivot at σ: E = ½ ks (R α sin φ)², α = σ/(L - σ), K(0) = ks R² α²,
/// from 0 to infinity as σ goes to L. Generic: the published devices contain a cam (CompAct) or a
/// planetary gear (vsaUT-II). Source: after Jafari et al. 2011, ICRA (AwAS-II).
struct MovingPivot {
  double ks;  ///< [N/m], > 0
  double R;   ///< arm of the link [m], > 0
  double L;   ///< [m]; the range of σ must end below
};
ElasticPtr moving_pivot(const MovingPivot& p, const Limits& l);

/// MACCEPA: a spring from the lever's tip to the link, pretensioned by winding σ = μ onto a drum:
///   E = ½ κ [A(φ) + r μ - (C - B)]²,   A = √(B² + C² - 2 B C cos φ).
/// Source: Van Ham et al. 2007, Robotics and Autonomous Systems 55.
struct Maccepa {
  double kappa;  ///< [N/m], > 0
  double B, C;   ///< lever, distance to the fixing point [m], 0 < B < C
  double drum;   ///< r [m], > 0
};
ElasticPtr maccepa(const Maccepa& p, const Limits& l = {});

/// MACCEPA 2.0: the lever is replaced by a profile on which the cable winds: E = ½ κ (l(φ) + r μ)²,
/// l(φ) a table, natural cubic spline (C²). Source: Vanderborght et al. 2011, Autonomous Robots 31;
/// the user provides the profile.
struct MaccepaProfile {
  double kappa;                       ///< [N/m], > 0
  double drum;                        ///< r [m], > 0
  std::vector<double> angle, length;  ///< l(φ) [rad], [m]; two points or more
};
ElasticPtr maccepa_profile(const MaccepaProfile& p, const Limits& l = {});

/// Floating spring between two cams that σ rotates against each other (FSJ): E = ½ κ [x(φ + σ) +
/// x(σ - φ) + x0]². Source: after Wolf, Eiberger, Hirzinger 2011, ICRA. The tables of the cams are
/// not public; the user provides x, as C² splines.
struct FloatingSpringCam {
  double kappa;                     ///< [N/m], > 0
  double x0 = 0;                    ///< preload [m]
  std::vector<double> angle, rise;  ///< x(·) [rad], [m]
};
ElasticPtr floating_spring_cam(const FloatingSpringCam& p, const Limits& l = {});

/// A roller on one cam, with its spring preloaded by σ (VS-Joint): E = ½ κ [x(φ) + σ]².
/// Source: after Wolf, Hirzinger 2008, ICRA.
struct PreloadCam {
  double kappa;                     ///< [N/m], > 0
  std::vector<double> angle, rise;  ///< x(·) [rad], [m]
};
ElasticPtr preload_cam(const PreloadCam& p, const Limits& l = {});

/// Two linear springs from the link to the levers of two servos, at the angles u1 = θ and u2 = σ
/// (Edinburgh):
///   E = ½ κ Σ (|s_i| - s0)²,
///   s1 = (-h - L sin u1 + a cos q, -d + L cos u1 + a sin q),   s2 = (h + L sin u2 - a cos q, -d +
///   L cos u2 - a sin q).
/// Not translation invariant: neither motor alone rotates the equilibrium.
/// Source: Mitrovic, Klanke, Vijayakumar 2011, IJRR 30, after Ham et al.
struct TwoSpringServo {
  double kappa, s0;  ///< [N/m], rest length [m], > 0
  double h, d;       ///< half the distance of the servos, their distance from the joint [m]
  double a, L;       ///< link's and servos' levers [m]
};
ElasticPtr two_spring_servo(const TwoSpringServo& p, const Limits& l = {});

}  // namespace porthos::vsa
