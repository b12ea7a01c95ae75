#pragma once
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "energy_shaping/laws/handover.h"
#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// Gains of a JointSwingUp.
struct SwingUpGains {
  /// What brings the driven joint to its place like an oscillator of that bandwidth ω [rad/s] and
  /// damping ratio ζ: k_D = 1, k_P = ω², k_V = 2 ζ ω; the energy gain, which the plant bounds, is
  /// chosen by JointSwingUp.
  static SwingUpGains of_bandwidth(double bandwidth, double damping_ratio) {
    return {.energy = 0,
            .inertia = 1,
            .stiffness = bandwidth * bandwidth,
            .damping = 2 * damping_ratio * bandwidth};
  }
  double energy = 1;        ///< k_E, of the error of the energy; 0: 0.9 of the largest possible
  double inertia = 0;       ///< k_D
  double stiffness = 0;     ///< k_P
  double damping = 0;       ///< k_V
  double limit = HUGE_VAL;  ///< |u| at most [N m | N]
  /// Largest acceleration of a pump [rad/s² | m/s²], beside the gains of of_bandwidth(); 0: none
  double pump = 0;
  /// μ of the energy E* + μ that is aimed at [J], 0 or more; none: 0, of a pump by the friction
  std::optional<double> margin = {};
};

/// A run for which settings are tried.
struct SwingUpRun {
  std::vector<double> start;  ///< (q, p)
  double duration;            ///< [s]
  double period;              ///< of the sampled laws [s]
  double step;                ///< of the integration, at most [s]
};

/// Swings a mechanism up by the energy that one driven joint a supplies: a cart-pole, a rotary
/// pendulum, an acrobot, a pendubot, a pendulum. Let ΔE = H - E*, E* the energy at rest in the
/// upright, and
///
///   V = ½ k_E ΔE² + ½ k_D q'_a² + ½ k_P (q_a - q_a*)²,   H' = u q'_a,   q''_a = a + m u,
///
/// with m = (M⁻¹)_aa. The law
///
///   u = -(k_V q'_a + k_P (q_a - q_a*) + k_D a) / (k_E ΔE + k_D m)                 (k_D > 0)
///
/// gives V' = -k_V q'_a² (Fantoni, Lozano 2002; of the acrobot Xin, Kaneda 2007). Its
/// denominator is positive at every state if k_D > k_E (E* - V(q))/m(q) for all q, which the
/// constructor checks. With k_D = 0 it is the law of Åström and Furuta (2000),
///
///   u = -k_E ΔE q'_a,   V = ½ ΔE²,   V' = -k_E (ΔE q'_a)²,
///
/// which keeps V' <= 0 under a limit too, but does not bring the joint itself to a place.
/// Friction of the driven joint is cancelled. That of other joints is not: E < E* then makes V
/// rise by k_E |ΔE| times its power, and the mechanism settles where the law pays for it, which can
/// be far below E*. A margin μ puts E* + μ in place of E*.
///
/// A pump pays for friction at full strength until E is near. It asks for the acceleration
///
///   w = -ω² (q_a - q_a*) - 2 ζ ω q'_a + A sat((E_o - E* - μ) h / s),   u = (w - a) / m,
///
/// with h = Σ M_ak q'_k and the energy E_o = H - q'_a p_a + ½ M_aa q'_a² of the other joints k, for
/// which E_o' = -h w - friction where q'_a = 0 (Åström, Furuta 2000, for any mechanism); s: a tenth
/// of the depth of the lowest rest below the upright times the h of a fall from there. The motion
/// of the driven joint adds to E_o': no Lyapunov function is known.
class JointSwingUp {
 public:
  /// @param actuator  port of the driven joint, one number
  /// @param upright   q*, nq numbers
  /// @throws InvalidArgument for constraints, joints of several degrees of freedom, gains of the
  ///   wrong sign and a condition that fails
  JointSwingUp(std::shared_ptr<const mechanics::MechanicalModel> plant, const std::string& actuator,
               std::vector<double> upright, const SwingUpGains& gains);

  const Certificate& certificate() const { return certificate_; }
  /// E* + margin [J]
  double wanted_energy() const { return data_->wanted; }
  /// The law as the controller of the actuator.
  PortLaw port_law() const;
  /// @param x  (q, p)
  /// @throws InvalidArgument for a start at which plant and law both rest: it would stay for ever
  void check_start(const std::vector<double>& x) const;
  /// What a run that has not handed over tells of the law.
  /// @param run  for which it tries other settings by simulation; none: it tries nothing
  Progress progress(const std::optional<SwingUpRun>& run = {}) const;

  struct Data {
    std::shared_ptr<const mechanics::MechanicalModel> plant;
    size_t joint;  ///< the driven one
    double target;
    SwingUpGains gains;
    double wanted = 0;    ///< E* + margin [J]
    double depth = 0;     ///< of the lowest rest below the upright [J]
    double soft = 0;      ///< s of a pump
    double friction = 0;  ///< sum of damping without actuator
    double margin = 0;
    double damping_ratio = 0.3;  ///< beside a bandwidth
    /// To begin with: a twentieth of the acceleration by the limit, or ten times what friction
    /// takes, at most a half. 0: without a limit it is not known
    double first_pump = 0;
  };

 private:
  void look_for_the_lowest(const std::vector<double>& upright);
  void check_denominator(const std::vector<double>& upright);
  void choose_margin(const std::vector<double>& upright);
  void check_pump(const std::vector<double>& upright);
  void check_descent(const std::vector<double>& upright);

  std::string actuator_;
  std::vector<double> upright_;
  std::shared_ptr<Data> data_;
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
