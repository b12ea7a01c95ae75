#pragma once
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "mechanics/rotation.h"
#include "phs/functions/law.h"
#include "phs/functions/motion.h"
#include "planning/gait.h"
#include "planning/whole_body.h"

namespace porthos::planning {

/// What a whole-body controller steers, by a spring and a damper in accelerations:
/// x'' = x_d'' + ω² (x_d - x) + 2 ζ ω (x_d' - x').
struct SteeredTask {
  enum class Kind {
    centre_of_mass,    ///< in the world
    position,          ///< of a point of a link
    attitude,          ///< of a link; the error is the turn that is left, in world axes
    posture,           ///< of joints
    angular_momentum,  ///< about the centre of mass: k' = -ω k, towards 0
    swing              ///< of the feet of a gait that do not stand
  } kind = Kind::centre_of_mass;
  std::string name;
  double bandwidth = 0, damping_ratio = 1;  ///< ω [rad/s], ζ
  std::string link = {};
  mechanics::Vec3d at{0, 0, 0};                          ///< the point, in the link's frame [m]
  std::array<bool, 3> axes{true, true, true};            ///< of the world, that are steered
  std::array<phs::Motion, 3> target = {};                ///< of centre_of_mass and position [m]
  mechanics::Quaternion<double> attitude{1, {0, 0, 0}};  ///< link to world
  struct Joint {
    int q, v;  ///< its coordinate and its freedom
    double target;
  };
  std::vector<Joint> joints = {};  ///< of posture
};

/// A part of a machine that touches flat ground: it holds its points where they are closed.
struct Support {
  std::string name;
  std::vector<ContactPoint> points;
  /// When it is not used, though it may touch: from and until [s], of each period if there is one.
  std::vector<std::array<double, 2>> lifted = {};
  /// Link to world, which a foot of three points or more keeps in its swing.
  mechanics::Quaternion<double> attitude{1, {0, 0, 0}};
};

/// What a whole-body controller is made of.
struct WholeBodyDesign {
  std::string name;  ///< in messages
  std::vector<Support> supports;
  std::vector<SteeredTask> tasks;  ///< the first is the most important
  std::vector<JointLimit> limits;
  double period = 1e-3;     ///< of the sampling [s]
  double holding = 0;       ///< see WholeBodyOptions [rad/s]
  double lifted_every = 0;  ///< the period of `lifted` [s]; 0: none
  /// A tank pays for its torques, in full from this level on [J]: what is above it is the budget of
  /// an instant. The level is read from y, see phs::SampledLaw.
  std::optional<double> reserve = {};
  /// Its feet are the supports; the centre of mass then moves horizontally as it wants.
  std::shared_ptr<const Gait> gait = {};
};

/// A whole-body controller as a sampled law. Its ports are those of motors(), its memory has what
/// it told: numbers of shown(), "error NAME" of each task and "force NAME" of each support; with a
/// gait "capture point" and "footstep NAME" of each support, and what the gait remembers.
///
/// A support point within 1 mm of the ground is a contact that keeps its velocity. If nothing keeps
/// contacts, cones and torque limits together, contacts give way: to keep their velocity is then
/// the first task, which story() tells.
/// Cost of an instant: WholeBody's.
class WholeBodyLaw final : public phs::SampledLaw {
 public:
  /// @throws InvalidArgument as WholeBody(); for a task of a link that does not move
  WholeBodyLaw(std::shared_ptr<const mechanics::MechanicalModel> model, WholeBodyDesign design);
  ~WholeBodyLaw() override;

  /// The ports, of one number each, in the order of u. Joints with a motor.
  const std::vector<std::string>& motors() const;
  std::vector<double> fresh() const override;
  /// @throws LawFailure if even contacts that give way leave no torques within the limits
  void operator()(double t, std::span<const double> x, std::span<const double> y,
                  std::span<double> memory, std::span<double> u) const override;
  std::vector<phs::Shown> shown() const override;
  std::vector<std::string> stories(std::span<const double> memory) const override;

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace porthos::planning
