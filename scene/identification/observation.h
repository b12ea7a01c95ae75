#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"
#include "scene/assemble/outputs.h"

namespace porthos::scene {

/// What a log may hold of a run: the numbers of [[output]]s, "tip.x"; "<joint>.position",
/// ".velocity" of joints of one freedom; of others "<joint>.angular_velocity.x" in the body's axes,
/// "<joint>.position.x" and ".linear_velocity.x" in the axes of the parent.
struct Observed {
  std::string name, unit;
  bool wraps = false;  ///< an angle, known up to whole turns
};
std::vector<Observed> observable(const Scene& scene, const Assembly& assembly);

/// Some of them, at states of an assembly. Not thread-safe.
class Observation {
 public:
  /// Scene and assembly must outlive it.
  /// @param names  of observable()
  Observation(const Scene& scene, const Assembly& assembly, const std::vector<std::string>& names);

  /// Their values at time t [s], in the order of the names.
  /// @param s  of the assembly's model;  to: one number a name
  void at(double t, const phs::State& s, std::span<double> to);

 private:
  struct OfJoint {
    enum class Kind { position, velocity, linear_velocity } kind;
    int at;            ///< in q or v
    int attitude = 0;  ///< in q, of a linear velocity
    int axis = 0;      ///< of it
  };
  struct Number {
    int output = -1;  ///< in the outputs; -1: of a joint
    OfJoint joint{};
  };
  const Assembly& assembly_;
  std::optional<Outputs> outputs_;
  bool rates_ = false;
  std::vector<Number> numbers_;

  friend std::vector<Observed> observable(const Scene&, const Assembly&);
  template <class Visit>
  static void each_of_joints(const Assembly& assembly, const Visit& visit);
};

}  // namespace porthos::scene
