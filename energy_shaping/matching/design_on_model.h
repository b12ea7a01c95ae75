#pragma once
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
#include "energy_shaping/matching/designs.h"
#include "mechanics/mechanical_model.h"

/// The designs of designs.h for mechanisms of two joints: their numbers are read off the mechanism,
/// and its motion under the law is compared with the design's.
namespace porthos::energy_shaping {

/// Which joints of a mechanism a design means, and where they are to rest.
struct DesignJoints {
  std::string driven;        ///< port of the joint with the actuator, one number
  std::vector<double> rest;  ///< q*, nq = 2 numbers: upright, level, wanted place
  double limit = HUGE_VAL;   ///< |u| at most [N m | N]
};

/// A design's coordinates and input in those of a mechanism: q_d = A (q - q*), and its input is the
/// driven joint's force over `scale`, or, `accelerated`, the driven joint's acceleration.
struct DesignMap {
  double A[2][2] = {{1, 0}, {0, 1}};
  bool accelerated = false;
  double scale = 1;
  /// The design's numbers that were read off the mechanism: name, value, meaning with unit.
  std::vector<std::tuple<const char*, double, const char*>> numbers = {};
};

/// A matched loop of a design as the law of a mechanism. Where M_d > 0 does not hold (a cart-pole
/// beyond the horizontal) the law is not defined, and its force is 0.
class DesignOnModel {
 public:
  /// @param loop  with its own plant, of 2 coordinates
  /// @throws InvalidArgument for a mechanism that is not of two joints of one degree of freedom,
  ///   and one that moves under the law otherwise than the design's plant
  DesignOnModel(std::shared_ptr<const mechanics::MechanicalModel> model, LoopPtr loop,
                const DesignMap& map, const DesignJoints& joints);

  /// That of the loop, then the numbers read off the mechanism and the comparison of the motions.
  const Certificate& certificate() const { return certificate_; }
  PortLaw port_law() const;

  struct Data {
    std::shared_ptr<const mechanics::MechanicalModel> model;
    LoopPtr loop;
    DesignMap map;
    size_t driven;  ///< joint
    std::vector<double> rest;
    double limit;
  };

 private:
  void check_motion();

  std::shared_ptr<const Data> data_;
  Certificate certificate_;
};

using ModelPtr = std::shared_ptr<const mechanics::MechanicalModel>;

/// A cart-pole; the driven joint is the cart's slide (or the arm of a pole that turns about a
/// parallel axis). d: k, m22, P, kv; a and b are read off the model.
DesignOnModel cart_pole_on(ModelPtr model, const DesignJoints& joints, CartPole d);
/// An acrobot; the driven joint is the elbow. d: a2, a3, ku, kv.
DesignOnModel acrobot_on(ModelPtr model, const DesignJoints& joints, Acrobot d);
/// A pendulum with a reaction wheel, whose joint is driven. d: a1, a2, a3, k1, kv.
DesignOnModel inertia_wheel_on(ModelPtr model, const DesignJoints& joints, InertiaWheelPendulum d);
/// The same with inertia_wheel_gains() of that pendulum.
DesignOnModel inertia_wheel_on(ModelPtr model, const DesignJoints& joints, double bandwidth,
                               double damping_ratio);
/// A body that slides along a beam; the beam's hinge, on the line of the slide, is driven. d: kp,
/// kv, for a ball of mass 1.
DesignOnModel ball_and_beam_on(ModelPtr model, const DesignJoints& joints, BallAndBeam d);

}  // namespace porthos::energy_shaping
