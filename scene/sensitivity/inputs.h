#pragma once
#include <span>
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// A number that a run depends on: a parameter of the model or a start value of the scene.
struct Input {
  std::string name;  ///< "link_2.mass", "joint_1.velocity"
  std::string unit;
  double value = 0;  ///< NaN of a turn of an attitude, which is a change alone
  bool start = false;
};

/// The inputs of a scene as the numbers that users give, and slopes along them. Each changes alone:
/// start values stay what they are, places and rates, where a mass changes the momenta.
///
/// Parameters: "<body>.mass" [kg], with the centre of mass and the inertia about it kept;
/// "<body>.com.x" [m] in the body's frame; "<body>.inertia.xx" [kg m²] about the centre of mass,
/// along the inertia axes of the model file, .xy for both elements; "<joint>.rotor_inertia",
/// ".stiffness", ".damping", ".rest"; "<element>.factor", a factor on its force, 1 in the scene; of
/// a sampled [[element]] of type controller "<element>.stiffness", ".damping", ".target", ".speed".
///
/// Start values: "<joint>.position", ".velocity"; of joints that turn freely "<joint>.attitude.x",
/// a small turn about the body's axis [rad], ".angular_velocity.x" in the body's axes, and where
/// they also move ".position.x", ".linear_velocity.x" in the axes of the parent.
class Inputs {
 public:
  /// @param names  of the parameters of the assembly's model, as phs::Linearised::parameters();
  ///   empty: none. Both must outlive it.
  Inputs(const Assembly& assembly, const std::vector<std::string>& names);

  const std::vector<Input>& list() const { return list_; }
  /// ∂J/∂(inputs) in the order of list().
  /// @param lambda  ∂J/∂x at the start, size nx;  parameters: ∂J/∂θ with that x kept, in the order
  ///   of the names
  std::vector<double> slopes(std::span<const double> lambda,
                             std::span<const double> parameters) const;

 private:
  void add_parameters();
  void add_starts();
  void add_start_slopes(std::span<const double> q, std::span<const double> v,
                        std::vector<double>& to) const;

  const Assembly& assembly_;
  const std::vector<std::string>& names_;
  std::vector<const mechanics::MassProperties*> bodies_;  ///< in the order of their parameters
  std::vector<double> q_, v_;                             ///< at the start
  std::vector<Input> list_;
};

}  // namespace porthos::scene
