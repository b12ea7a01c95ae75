#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "integrators/control/energy_monitor.h"
#include "integrators/control/step_control.h"
#include "mechanics/panel.h"
#include "mechanics/urdf.h"
#include "scene/read/actuator.h"
#include "scene/read/constraints.h"
#include "scene/read/contact.h"
#include "scene/read/controller.h"
#include "scene/read/element.h"
#include "scene/read/event.h"
#include "scene/read/input_files.h"
#include "scene/read/orbit.h"
#include "scene/read/output.h"
#include "scene/read/robot.h"
#include "scene/read/start_from.h"

/// A scene: one TOML file that describes a run completely. Every key is documented in
/// docs/scene.md.
namespace porthos::scene {

/// Start values of one joint.
struct JointStart {
  double position = 0, velocity = 0;     ///< of one degree of freedom [rad | m], [rad/s | m/s]
  bool states_velocity = false;          ///< velocity is stated, and not 0 for lack of it
  std::optional<BaseStart> motion = {};  ///< of a ball or a free joint, in the joint's frame
  bool translates = false;               ///< the motion has a position or a linear velocity
  std::string where = {};                ///< "file:line"
};

/// Seeded random joint states for joints without stated values: uniform in ± the bounds.
struct RandomStart {
  std::uint64_t seed = 1;
  double joint_position = 0, joint_velocity = 0;
};

/// The quantities whose smallest and largest values since the previous record are stored in a
/// record, over all steps.
enum class Extrema { none, state, all };

/// Limits of the verdict. A limit that is not stated is not checked; if none is stated,
/// default_limits() apply.
struct Limits {
  using Limit = std::optional<double>;
  Limit energy = {}, linear_momentum = {}, angular_momentum = {}, quaternion_norm = {};
  Limit balance = {}, symmetry = {}, step_halving = {};
  Limit orbital = {}, coupling = {};  ///< of spacecraft in orbit
  Limit constraints = {};             ///< of loops and couplings
  bool any() const;                   ///< whether a limit is stated
};

/// Of the joints, or of every body, with each joint as a loop (mechanics/constraints/maximal.h).
enum class Coordinates { reduced, maximal, faster };

/// Name for a method chosen by pilot runs, see compare/auto_method.h.
inline constexpr const char* auto_method = "auto";

/// The content of a scene file, with defaults.
struct Scene {
  std::string path;  ///< as given; its folder resolves relative paths
  std::string text;  ///< whole text, for provenance
  std::string title;

  std::string urdf_path, urdf_text;            ///< resolved path, and content with the robots
  InputFiles files;                            ///< other files it names
  std::map<std::string, std::string> digests;  ///< "trajectory_sha256": files not kept in results
  mechanics::UrdfOptions urdf;  ///< base, gravity, links without inertia, given inertias
  std::map<std::string, double> mass_factor;  ///< of links: factor of mass and inertia
  Coordinates coordinates = Coordinates::reduced;
  std::string why_coordinates;  ///< of a free choice that the scene itself decides
  bool centre_stays = false;    ///< in the equations, though it could be taken out

  BaseStart base;
  std::map<std::string, JointStart> joints;
  std::optional<RandomStart> random;
  std::optional<StartFrom> start_from;       ///< instead of all of them
  std::vector<Element> elements;             ///< at the joints, in addition to the model file
  std::vector<FreeBody> bodies;              ///< in addition to the model
  std::vector<Robot> robots;                 ///< likewise; urdf_text has their links and joints
  std::vector<mechanics::Panel> panels;      ///< flexible ones, on links of the model
  mechanics::Vec3d magnetic_field{0, 0, 0};  ///< constant in the world [T]; in orbit the planet's
  std::vector<Event> events;                 ///< in the order of their times
  std::vector<JointActuator> actuators;
  SceneConstraints constraints;  ///< [[loop]] and [[coupling]]
  std::vector<SceneContact> contacts;
  std::vector<Controller> controllers;  ///< over several joints
  std::vector<Output> outputs;          ///< recorded besides the states
  std::vector<Stop> stops;              ///< conditions that end the run
  std::optional<OrbitScene> orbit;      ///< around a planet; empty in free space or on the ground

  std::string method =
      "gauss16";    ///< or "auto" until a method is chosen, see compare/auto_method.h
  double step = 0;  ///< [s]; with "auto" the first guess, 0: none
  std::optional<double> target_energy_error;  ///< with "auto": over the whole run, relative
  std::string choice;                         ///< the choice of "auto" and its reason, once made
  double rtol = 1e-12;                        ///< of rivals that take a tolerance
  double iteration_tolerance =
      0;  ///< of implicit methods, see integrators::Options; 0: to rounding
  integrators::StepControl step_control = integrators::StepControl::fixed;
  double control_rate = 0;    ///< [rad/s], see integrators::ControlOptions
  double control_length = 0;  ///< [m]

  std::optional<integrators::MonitorOptions> monitor;  ///< watches the balance during the run

  double duration =
      0;  ///< [s]; the last step is shorter where the steps do not add up, see assemble/steps.h
  double record_every = 0;  ///< [s]; rounded to whole steps, at least one
  bool record_every_given =
      false;  ///< by the file; if not, it follows overrides of step and duration
  Extrema extrema = Extrema::none;  ///< of the window before each record
  bool low_words = false;           ///< records have those of the state
  double checkpoint_every = 60;     ///< wall-clock seconds

  Limits verify;
  std::uint64_t of_case = 0;  ///< in an ensemble its case, from 1: the noise of its sensors differs

  /// Whether bodies roll or slide on blades: constraints of rates alone.
  bool rolls() const { return !constraints.spec.rollings.empty(); }
  /// Whether loops or couplings constrain the mechanism (a file without any <mimic> may still have
  /// none).
  bool is_constrained() const {
    return !constraints.empty() || urdf.couple_mimics || coordinates == Coordinates::maximal;
  }
  /// The energy error for which a method is searched: the stated one, else the limit of the
  /// verdict, else 1e-9.
  double target() const {
    if (target_energy_error) return *target_energy_error;
    return verify.energy && *verify.energy > 0 ? *verify.energy : 1e-9;
  }
};

/// Reads and validates a scene. @throws InvalidArgument with one sentence "file:line:column: ..."
/// for a missing file, broken TOML, an unknown key (names the nearest known one), a wrong type or
/// unit, a value out of range.
Scene read_scene(const std::string& path);

/// The limits of a scene that states none; docs/scene.md gives the reasons.
Limits default_limits(bool in_orbit);

/// Command-line overrides; a bad one is refused like a bad key.
struct Overrides {
  std::optional<std::string> method = {};
  std::optional<double> step = {}, duration = {};
};
void apply(Scene& scene, const Overrides& overrides);

}  // namespace porthos::scene
