#pragma once
#include <memory>
#include <span>
#include <vector>

#include "energy_shaping/loop/port_law.h"
#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// Desired positions of the joints: q_d(t) with two derivatives, each of size() numbers. Immutable,
/// shared by threads.
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  virtual size_t size() const = 0;
#define PORTHOS_AT(T) \
  virtual void at(T t, std::span<T> q, std::span<T> v, std::span<T> a) const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_AT)
#undef PORTHOS_AT
};

/// Fills `at` from Derived::motion<T>(t, q, v, a).
template <class Derived>
class TrajectoryFor : public Trajectory {
 public:
#define PORTHOS_AT(T)                                                           \
  void at(T t, std::span<T> q, std::span<T> v, std::span<T> a) const override { \
    static_cast<const Derived*>(this)->template motion<T>(t, q, v, a);          \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_AT)
#undef PORTHOS_AT
};

/// From one set of coordinates to another in the time T: a polynomial of degree 7 with zero rates,
/// accelerations and jerks at both ends.
std::shared_ptr<const Trajectory> rest_to_rest(std::vector<double> from, std::vector<double> to,
                                               double duration);
/// q_i = centre_i + amplitude_i sin(2π frequency_i t).
std::shared_ptr<const Trajectory> sines(std::vector<double> centre, std::vector<double> amplitude,
                                        std::vector<double> frequency_Hz);

/// Tracking of a fully actuated arm (PD+, Paden, Panja 1988):
///   τ = M(q) q_d'' + C(q, q') q_d' + D q' + ∂V/∂q - Kp e - Kd e',   e = q - q_d
/// with C of Christoffel's symbols, so that M' - 2C is skew and H_e = ½ e'ᵀM e' + ½ eᵀKp e falls
/// exactly by e'ᵀKd e'. H_e depends on time through q_d: asymptotic stability is Matrosov's
/// theorem, not LaSalle's. Not a ClosedLoop, whose H_d is a function of the state alone.
class PdPlus {
 public:
  /// @throws InvalidArgument for joints of several degrees of freedom, a trajectory of other
  /// joints, gains of the wrong number or sign
  PdPlus(std::shared_ptr<const mechanics::MechanicalModel> plant,
         std::shared_ptr<const Trajectory> trajectory, std::vector<double> kp,
         std::vector<double> kd);

  ~PdPlus();
  const mechanics::MechanicalModel& plant() const { return *parts_->plant; }

  /// u = τ at time t and the plant's state x = (q, p): nv numbers, followed by zeros for body
  /// ports. Three RNEA.
  void law(double t, std::span<const double> x, std::span<double> u);
  /// The law as controllers of the joints' ports, for a network with the plant (port_law.h).
  std::vector<PortLaw> port_laws() const;
  /// H_e [J].
  double error_energy(double t, std::span<const double> x);
  /// e'ᵀKd e' [W], the rate at which H_e falls.
  double error_power(double t, std::span<const double> x);
  /// The largest |e_i| [rad | m].
  double error(double t, std::span<const double> x);

  /// What it was made of.
  struct Parts {
    std::shared_ptr<const mechanics::MechanicalModel> plant;
    std::shared_ptr<const Trajectory> trajectory;
    std::vector<double> kp, kd;
  };
  template <class T>
  class Evaluator;

 private:
  std::shared_ptr<const Parts> parts_;
  std::unique_ptr<Evaluator<double>> evaluator_;
};

}  // namespace porthos::energy_shaping
