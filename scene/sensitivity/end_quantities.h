#pragma once
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// A number at the end of a run, and its slopes there.
struct EndQuantity {
  std::string name, unit;
  double value = 0;
  std::vector<double> by_state;       ///< ∂/∂x, size nx
  std::vector<double> by_parameters;  ///< ∂/∂θ at that x
  double error = 0;                   ///< of by_state, relative; 0: exact to rounding
};

/// How far each number of the state x of a mechanism is moved at first to see slopes: by a part of
/// its size.
std::vector<double> moves_of(const mechanics::Mechanism& m, const std::vector<double>& x);

/// What can be asked about the end of a run: the numbers of [[output]]s that are places and rates,
/// and formulas of them, "tip.x"; "<joint>.position", ".velocity"; of joints that turn freely
/// "<joint>.attitude.x", the rotation vector from the parent's axes, its turn up to π [rad],
/// "<joint>.angular_velocity.x" in the body's axes, and where they also move ".position.x",
/// ".linear_velocity.x" in the axes of the parent; "energy", H [J].
///
/// Slopes of outputs by the state are differences (ridders.h), which tell their error; the others
/// come by duals. The assembly's state must be that of the world: Assembly::centre is empty.
class EndQuantities {
 public:
  /// Both must outlive it.
  EndQuantities(const Scene& scene, const Assembly& assembly);

  /// Those asked about by default: the outputs; without any, the places.
  const std::vector<std::string>& usual() const { return usual_; }
  /// All of them.
  const std::vector<std::string>& known() const { return known_; }
  /// Sentences on outputs that have no slopes.
  const std::vector<std::string>& left_out() const { return left_out_; }
  /// @throws InvalidArgument for a name that is none, with the nearest known one
  void require(const std::string& name) const;

  /// Their values and slopes at time t [s]. @throws InvalidArgument as require()
  /// @param parameters  names, as phs::Linearised::parameters() of the model
  std::vector<EndQuantity> at(double t, const phs::State& s, const std::vector<std::string>& names,
                              const std::vector<std::string>& parameters) const;

 private:
  std::vector<EndQuantity> of_outputs(double t, const phs::State& s) const;
  std::vector<EndQuantity> of_joints(const phs::State& s) const;
  EndQuantity energy(const phs::State& s, const std::vector<std::string>& parameters) const;

  const Scene& scene_;
  const Assembly& assembly_;
  std::vector<Output> outputs_;  ///< those with slopes
  std::vector<std::string> known_, usual_, left_out_;
};

}  // namespace porthos::scene
