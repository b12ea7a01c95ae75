#pragma once
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"
#include "planning/task_hierarchy.h"

namespace porthos::planning {

/// What a contact does at an instant.
enum class Touch {
  holds,   ///< the point keeps its velocity, see `holding`, and the world pushes
  pushes,  ///< the world pushes a point that may accelerate, as where it slides
  none     ///< the world does not push
};

/// A point of a body that the world may push: |tangential force| ≤ friction · normal force.
struct ContactPoint {
  std::string name;
  std::string body;
  mechanics::Vec3d position{0, 0, 0};  ///< in the body's frame [m]
  mechanics::Vec3d normal{0, 0, 1};    ///< world axes, from the ground to the body
  mechanics::Vec3d ground{0, 0, 0};    ///< a point of the ground, see holding [m]
  double friction = 0.7;
  int edges = 4;  ///< of the pyramid inscribed in the cone, ≥ 3: cos(π/edges) of μ across a face
  double least = 0;                                       ///< normal force [N], ≥ 0
  double most = std::numeric_limits<double>::infinity();  ///< normal force [N]
  Touch touch = Touch::holds;                             ///< until WholeBody::touch() changes it
  double radius = 0;  ///< of a ball about `position`, which touches at its lowest point [m]
};

/// Limits of a joint of one freedom. What is not stated is not limited.
struct JointLimit {
  std::string joint;
  double torque = std::numeric_limits<double>::infinity();  ///< |τ| [N m | N]; 0: no motor
  double rate = std::numeric_limits<double>::infinity();    ///< |v + T v'| [rad/s | m/s]
  double lower = -std::numeric_limits<double>::infinity();  ///< of q + T v + ½T²v' [rad | m]
  double upper = std::numeric_limits<double>::infinity();
};

/// What a whole-body controller is told beside the mechanism.
struct WholeBodyOptions {
  std::vector<ContactPoint> contacts;
  std::vector<JointLimit> limits;
  double period = 1e-3;  ///< T: how far the limits of rate and position look ahead [s]
  /// ω [rad/s]: contacts that hold accelerate by -2ω v - ω² gap, so that what slips stops and what
  /// tilts comes down; three points or more turn likewise. 0: they keep their velocity.
  double holding = 0;
};

/// A point of a body and its motion, in world axes.
struct PointMotion {
  mechanics::Mat3<double> R;         ///< of the body
  mechanics::Vec3d at;               ///< [m]
  mechanics::Vec3d turning, moving;  ///< of the body [rad/s], of the point [m/s]
};

/// Accelerations, contact forces and torques at one state.
struct WholeBodySolution {
  bool possible = false;  ///< false: nothing keeps the equations, cones and torque limits together
  std::string why;        ///< if not possible: what fails, and by how much
  std::vector<double> v_dot;          ///< nv
  std::vector<double> forces;         ///< 3 for each contact, on the body, world axes [N]
  std::vector<double> tau;            ///< nv; zero where there is no motor. Empty if not possible
  std::vector<std::string> exceeded;  ///< limits of rate, position, work that cannot be kept
  double work = 0;       ///< T τᵀ(v + ½T v'): what the motors supply within a period [J]
  bool limited = false;  ///< the tasks asked for more work than the budget
  std::span<const LevelOutcome> tasks;  ///< of each level given to solve()
};

/// Inverse dynamics of a whole mechanism with strict priorities. The unknowns are z = (v', f/m):
/// joint accelerations and the contact forces in world axes over the total mass m. The levels are,
/// in this order: M v' + b = Sᵀτ + J_cᵀ f for freedoms without motor, and J_c v' + J̇_c v = 0 of
/// contacts, of the whole body where it is held at three points or more; pyramids inscribed in the
/// friction cones and torque limits; limits of rate and position; the tasks. Joints of several
/// freedoms (a free base) have no motor.
/// Sources: Saab et al. 2013 (IEEE Trans. Robot. 29); Escande, Mansard, Wieber 2014.
class WholeBody {
 public:
  /// @throws InvalidArgument naming the contact or joint: unknown or repeated names, a body that
  ///   does not move, a normal of length 0, negative friction or limits, lower above upper
  WholeBody(std::shared_ptr<const mechanics::Mechanism> mechanism, WholeBodyOptions options);
  ~WholeBody();
  WholeBody(WholeBody&&) noexcept;

  /// The state at which tasks are made and solved. @param q  size nq;  v size nv
  /// @throws InvalidArgument for wrong sizes
  void update(std::span<const double> q, std::span<const double> v);

  /// The most that the motors may supply within a period [J], see WholeBodySolution::work. It is
  /// kept as limits of rate and position are: above all tasks. Infinity, as at first: no limit.
  /// @throws InvalidArgument for a negative number
  void budget(double work);

  /// What a contact does from now on. @param contact  in the order of the options
  void touch(size_t contact, Touch now);
  Touch touch(size_t contact) const;
  /// Where a contact's point is at the last update(): of a ball the lowest one.
  PointMotion contact(size_t contact) const;

  /// Where a point of a body is at the last update(). @param position  in the body's frame [m]
  PointMotion point(const std::string& body, const mechanics::Vec3d& position) const;
  /// The centre of mass [m], its velocity [m/s], and the angular momentum about it [N m s].
  struct Centre {
    mechanics::Vec3d at, moving, spin;
  };
  Centre centre() const;

  /// A point of a body accelerates as wanted. The axes are the world's.
  /// @param acceleration  of the body's rotation [rad/s²] and of the point [m/s²]: 6 numbers,
  ///   [angular; linear]; NaN leaves a component free
  TaskLevel frame(const std::string& body, const mechanics::Vec3d& position,
                  std::span<const double> acceleration) const;
  /// Joint accelerations. @param v_dot  size nv; NaN leaves a freedom free
  TaskLevel joints(std::span<const double> v_dot) const;
  /// The rate of the centroidal momentum, k_G' [N m] and P' [N]: rows over the total mass.
  /// @param rate  6 numbers, [angular; linear], world axes; NaN leaves a component free
  TaskLevel momentum(std::span<const double> rate) const;
  /// The acceleration of the centre of mass [m/s²]. @param acceleration  3 numbers; NaN: free
  TaskLevel centre_of_mass(std::span<const double> acceleration) const;
  /// The contacts that push keep their velocity: what Touch::holds demands, as a task.
  TaskLevel still_contacts() const;
  /// The smallest contact forces.
  TaskLevel small_forces() const;

  /// @param tasks  the first is the most important; rows over z
  /// @param calm   what to ask for where the budget is too small: each task with another b. The
  ///   last give way first; the one with which the work comes within the budget does in part.
  ///   Empty, or if all are not enough: what is asked for is met as the budget lets it, the first
  ///   task first
  /// @return valid until the next call
  const WholeBodySolution& solve(std::span<const TaskLevel> tasks,
                                 std::span<const TaskLevel> calm = {});

  const mechanics::Mechanism& mechanism() const;
  int unknowns() const;  ///< nv + 3 contacts

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// Adds the rows of `more` to a level, its task times `weight`.
void append(TaskLevel& level, const TaskLevel& more, double weight = 1);

/// Where a flat ground at height 0 must push so that no horizontal moment is left:
/// p_G - z p_G''/(g + z'') - k_G' × e_z/(m(g + z'')).
/// @param com, com_acceleration  of the centre of mass, z above the ground [m, m/s²]
/// @param k_rate  rate of the angular momentum about the centre of mass [N m]
/// @throws InvalidArgument unless mass and g + z'' are positive: then nothing pushes
mechanics::Vec3d zero_moment_point(double mass, double g, const mechanics::Vec3d& com,
                                   const mechanics::Vec3d& com_acceleration,
                                   const mechanics::Vec3d& k_rate);

/// Torques that give a task its acceleration, and τ0 where the task does not feel it:
/// τ = Jᵀ(Λ(ẍ - J̇v) + J̄ᵀb) + (1 - JᵀJ̄ᵀ)τ0 with Λ = (J M⁻¹ Jᵀ)⁻¹, J̄ = M⁻¹JᵀΛ.
/// @param M  n × n;  J  task × n, row after row, of full rank;  b, tau0 size n (the forces that the
///   free motion needs; τ0 empty: none);  acceleration, J_dot_v one for each row;  tau written, n
/// @throws InvalidArgument for sizes that do not fit, a J that has not full rank
/// Source: Khatib 1987 (IEEE J. Robot. Autom. 3).
void operational_space_torque(std::span<const double> M, std::span<const double> b,
                              std::span<const double> J, std::span<const double> J_dot_v,
                              std::span<const double> acceleration, std::span<const double> tau0,
                              std::span<double> tau);

}  // namespace porthos::planning
