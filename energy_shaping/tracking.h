#pragma once
#include <memory>
#include <span>
#include <vector>

#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// Where the joints are to be: q_d(t) with two derivatives, each of nv numbers.
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  virtual void at(double t, std::span<double> q, std::span<double> v,
                  std::span<double> a) const = 0;
};

/// From one set of coordinates to another in the time T: a polynomial of degree 7 with zero rates, accelerations and jerks
/// at both ends.
std::shared_ptr<const Trajectory> rest_to_rest(std::vector<double> from, std::vector<double> to,
                                               double duration);
/// q_i = centre_i + amplitude_i sin(2π frequency_i t).
std::shared_ptr<const Trajectory> sines(std::vector<double> centre, std::vector<double> amplitude,
                                        std::vector<double> frequency_Hz);

/// Tracking of a fully actuated arm (PD+, Paden, Panja 1988):
///   τ = M(q) q_d'' + C(q, q') q_d' + D q' + ∂V/∂q - Kp e - Kd e',   e = q - q_d
/// with C of Christoffel's symbols, so that M' - 2C is skew and H_e = ½ e'ᵀM e' + ½ eᵀKp e falls exactly by e'ᵀKd e'.
/// H_e depends on time through q_d: asymptotic stability is Matrosov's theorem, not LaSalle's. Not a ClosedLoop, whose H_d is
/// a function of the state alone.
class PdPlus {
 public:
  /// @throws InvalidArgument for joints of several freedoms, gains of the wrong number or sign
  PdPlus(std::shared_ptr<const mechanics::MechanicalModel> plant,
         std::shared_ptr<const Trajectory> trajectory, std::vector<double> kp,
         std::vector<double> kd);

  /// u = τ at time t and the plant's state x = (q, p): nv numbers, followed by zeros for body ports. Three RNEA.
  void law(double t, std::span<const double> x, std::span<double> u);
  /// H_e [J].
  double error_energy(double t, std::span<const double> x);
  /// e'ᵀKd e' [W], the rate H_e falls at.
  double error_power(double t, std::span<const double> x);
  /// The largest |e_i| [rad | m].
  double error(double t, std::span<const double> x);

 private:
  void compare(double t, std::span<const double> x);

  std::shared_ptr<const mechanics::MechanicalModel> plant_;
  std::shared_ptr<const Trajectory> trajectory_;
  std::vector<double> kp_, kd_;
  mechanics::Workspace<double> w_;
  size_t n_;
  std::vector<double> q_, v_, a_, rate_, e_, de_, sum_, both_, first_, second_, zero_;
};

}  // namespace porthos::energy_shaping
