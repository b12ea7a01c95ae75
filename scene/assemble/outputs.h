#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "contact/soft_touches.h"
#include "integrators/core/run_model.h"
#include "mechanics/mechanism.h"
#include "phs/system/reactions.h"
#include "scene/assemble/assembly.h"
#include "scene/read/formula.h"
#include "scene/read/output.h"

namespace porthos::scene {

/// A series of an output in the records.
struct OutputColumn {
  std::string name, unit;
  size_t size;
};
/// Of the scene's outputs, in their order.
std::vector<OutputColumn> output_columns(const Scene& scene, const Assembly& assembly);

/// The unit of one number of an output or a panel: of a wrench, "N m, N", the first one of its
/// moments, "mx", and the second one of its forces.
std::string unit_of_number(const std::string& unit, const std::string& name);
/// The unit of each number of all outputs, in the order of number_names().
std::vector<std::string> number_units(const Scene& scene, const Assembly& assembly);

/// A point on a link of a mechanism.
struct PlaceOnLink {
  int node = -1;  ///< of the moving body; -1: the world
  mechanics::Pose pose;
};
/// @throws InvalidArgument beginning with `where`, for a link that there is not
PlaceOnLink place_on_link(const mechanics::Mechanism& m, const LinkPoint& point,
                          const std::string& where);

/// Evaluates the [[output]]s of a scene at states of its assembly. Joints that an event has locked
/// and what acts at them have no outputs: NaN.
///
/// joint_torque of a joint is the difference of p' with and without the scene's parts, of ball and
/// free joints in body axes. joint_wrench
/// is the rate of change of the momentum of all bodies that the joint carries, exact by duals, less
/// their weight. Cost of the two: an evaluation of the field, of duals for the wrench; others cost
/// a pass of kinematics. Not thread-safe.
class Outputs {
 public:
  /// Scene and assembly must outlive it.
  /// @throws InvalidArgument with file and line, for a link, joint or row that does not exist, and
  ///   for a quantity that the scene does not have
  Outputs(const Scene& scene, const Assembly& assembly) : Outputs(scene, assembly, scene.outputs) {}
  /// Some of them, see needed_for().
  Outputs(const Scene& scene, const Assembly& assembly, std::vector<Output> outputs);

  size_t size() const { return size_; }
  /// @param s  as integrated: relative to Assembly::centre if there is one
  /// @param held  values of the sampled controllers, as Sampler::memory()
  /// @param inputs  of Assembly::model (size nu) that act there; empty: none
  /// @return all numbers, valid until the next call. Allocates nothing after the first call.
  std::span<const double> at(double t, const phs::State& s, std::span<const double> held,
                             std::span<const double> inputs = {});

 private:
  using Place = PlaceOnLink;
  struct Item {
    const Output* output;
    Place of, seen_from;
    int q = 0, v = 0, turn = -1, node = -1;  ///< of the joint
    std::vector<size_t> nodes = {};          ///< of a momentum; empty: all
    bool whole = false;                      ///< its momenta follow from all numbers of the joint
    bool turned = false;                     ///< the child of its joint carries what was the parent
    int row = -1;                            ///< of the storage or power
    size_t contact = 0;                      ///< of ContactModel::contacts()
    size_t told = 0;                         ///< place in the memory of the sampled controllers
    const vsa::Actuator* actuator = nullptr;
    ActuatorPlace at;
    bool gone = false;
    std::optional<Formula> formula;
  };
  using Dual = phs::Dual;

  void bind(Item& item);
  void bind_joint(Item& item);
  void bind_row(Item& item);
  void bind_actuator(Item& item);
  void bind_contact(Item& item);
  void bind_told(Item& item);
  void refuse_wrench(const Output& o) const;
  void hold(std::span<const double> held);
  void evaluate_fields(double t, const phs::State& s, std::span<const double> inputs);
  void evaluate(Item& item, const phs::State& s, std::span<double> to);
  double torque(const Item& item, const phs::State& s) const;
  double of_actuator(const Item& item, const phs::State& s) const;
  double of_orbit(const Item& item, const phs::State& s) const;
  double of_motor(const Item& item, const vsa::Slopes<double>& slopes) const;
  void of_contact(const Item& item, std::span<double> to) const;
  void motion(const Item& item, std::span<double> to) const;
  void frame(const Item& item, std::span<double> to) const;
  void momenta(const Item& item, std::span<double> to) const;
  void wrench(const Item& item, const phs::State& s, std::span<double> to);
  mechanics::Pose pose_of(const Place& p) const;
  mechanics::Motion<double> twist_at(const Place& p) const;

  const Scene& scene_;
  const Assembly& assembly_;
  const std::vector<Output> outputs_;
  /// The system and its internal motion, with values of the sampled controllers of their own.
  const integrators::RunModel model_, inner_model_;
  WorldView view_;
  size_t size_ = 0;
  std::vector<double> values_;
  std::vector<Item> items_;
  std::optional<mechanics::Workspace<double>> w_;
  std::optional<mechanics::Workspace<Dual>> dual_w_;
  std::vector<mechanics::Pose> poses_;
  std::vector<mechanics::Transform<Dual>> dual_poses_;
  std::vector<Dual> dual_q_, dual_p_;
  std::vector<char> carried_;             ///< by the joint of a wrench
  bool places_ = false, twists_ = false;  ///< what is needed
  // The system in motion, without the orbit, and the mechanism alone.
  std::unique_ptr<phs::System<double>> whole_, inner_, mechanism_;
  std::optional<contact::SoftTouches> contacts_;
  std::span<const contact::SoftTouch> touches_;
  std::optional<phs::Reactions> reactions_;  ///< of couplings and driven joints, for wrenches
  std::vector<double> stored_, powers_, efforts_, field_, bare_field_, forces_, angles_;
};

}  // namespace porthos::scene
