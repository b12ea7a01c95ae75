#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/laws/potential_loop.h"
#include "energy_shaping/loop/port_law.h"

namespace porthos::energy_shaping {

/// The actuators that make the wrench on a floating base.
struct WheelBaseOptions {
  std::string base_port = "base.wrench";
  /// their ports, "wheel_x.torque": axisymmetric wheels on the base, three axes or more
  std::vector<std::string> wheels;
  std::vector<double> limits = {};  ///< largest |torque| of each wheel [N m]; empty: none
  /// Largest |p_w| of each wheel [N m s], empty: none. A torque held for `period` [s] stops short
  /// of it: the wheel is full and takes up no more, in any order of unloading and turning back.
  std::vector<double> capacities = {};
  double period = 0;
  int samples = 500;  ///< random states of the checks
  double tolerance = 1e-10;
};

/// Pose of a floating base, SE(3), by thrusters and reaction wheels: a potential shaping that asks
/// for a wrench at the base (pose springs with the trace potential, damping; joints of an arm may
/// take part) with its force made by the thrusters, base port's linear part, and its moment n by
/// the wheels, A τ = -n with A their axes, least |τ|.
///
/// A wheel's momentum is p_w = I_w (θ' + aᵀω), and p_w' = τ_w. With the wheels' part taken out of
/// the energy,
///   H_d = H - Σ p_w²/(2 I_w) + U (- V),    H_d' = -(damping of the shaped loop),
/// for any spin of the wheels and any total momentum: spin enters the base's motion as a gyroscopic
/// term, which has no power. So the base comes to rest where H_d is least, and the wheels keep the
/// momentum they took up. Without thrusters a shaping without force (an attitude alone) is held in
/// the same way. Not a ClosedLoop: the wheels keep turning at rest, and H_d does not depend on
/// their angles.
class WheelBase {
 public:
  /// shaped: made for the plant with the base port among its actuators and no spring or damping at
  /// the wheels.
  /// @throws InvalidArgument for ports that are none of a wheel's, capacities without a period,
  ///   axes that do not span all directions, a wheel that is not axisymmetric, or a balance of H_d
  ///   that does not hold, with the number
  WheelBase(std::shared_ptr<const PotentialLoop> shaped, WheelBaseOptions options);

  const PotentialLoop& shaped() const { return *shaped_; }
  const Certificate& certificate() const { return certificate_; }
  /// u of the plant at its state x: force, no moment, wheels, joints. Makes a new evaluator for
  /// each call; port_laws() keep theirs.
  void law(std::span<const double> x, std::span<double> u) const;
  /// As controllers of a network (port_law.h): the base's port, the wheels' and those of the shaped
  /// joints.
  std::vector<PortLaw> port_laws() const;
  /// H_d [J].
  double hamiltonian(std::span<const double> x) const;
  /// The rate at which H_d falls [W].
  double dissipation(std::span<const double> x) const;

  struct Parts {
    std::shared_ptr<const PotentialLoop> shaped;
    size_t base = 0;                      ///< offset of the base's wrench in u
    std::vector<size_t> inputs, momenta;  ///< offsets of each wheel in u and of its momentum in x
    std::vector<double> inertia;          ///< I_w [kg m²]
    std::vector<double> allocate;         ///< wheels × 3: τ = allocate · n
    std::vector<double> limits;
    std::vector<double> capacities;  ///< [N m s]
    double period = 0;               ///< [s]
    template <class T>
    auto evaluator() const;
  };

 private:
  void check(const WheelBaseOptions& options);
  std::shared_ptr<const PotentialLoop> shaped_;
  Parts parts_;
  std::vector<int> actuated_;
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
