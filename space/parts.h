#pragma once
#include <memory>
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "phs/functions/function.h"

/// Parts of a spacecraft that act on its bodies: thrusters, wrenches of time, magnetic torquers,
/// soft latches.
namespace porthos::space {

using mechanics::Mat3;
using mechanics::Pose;
using mechanics::Vec3;
using mechanics::Vec3d;

/// The on-times of a part: from the first instant to the second, from the third to the fourth, and
/// so on.
class Schedule {
 public:
  /// Always on.
  Schedule() = default;
  /// @throws InvalidArgument unless the times rise and are finite and 0 or more
  explicit Schedule(std::vector<double> switches);
  /// `count` pulses of `width`, one every `period`, the first at `start` [s].
  /// @throws InvalidArgument unless 0 < width < period and 1 <= count <= 1e6
  static Schedule pulses(double start, double period, double width, long count);

  /// 1 inside, 0 outside, and ½ at the switching instants (within rounding of t). A method with
  /// stages of equal weight at both ends of its steps then gives an interval of whole steps its
  /// exact impulse.
  double at(double t) const;
  /// Total on-time from 0 to t [s].
  double on_time(double t) const;
  const std::vector<double>& switches() const { return switches_; }
  /// The first switching instant that is not a whole number of steps h; negative if all are.
  double off_grid(double h) const;

 private:
  std::vector<double> switches_;
  bool always_ = true;
};

/// A thruster: while it is on, a constant force along a line fixed in a link.
struct Thruster {
  std::string name, link;
  Vec3d position{0, 0, 0};   ///< in the link's frame [m]
  Vec3d direction{1, 0, 0};  ///< of the force on the link, in its axes; unit
  double thrust = 0;         ///< [N]
  Schedule schedule;
  double specific_impulse = 0;  ///< [s]; 0: not given. The mass of the links is constant.
};

/// A wrench that is known in time, on a link: of a test stand, a plume, another program's tables.
struct Wrench {
  /// A vector that is a sum of signals, each along a direction.
  struct Term {
    Vec3d along;
    phs::FunctionPtr size;
  };
  using Signals = std::vector<Term>;
  std::string name, link;
  Vec3d position{0, 0, 0};  ///< where the force acts, in the link's frame [m]
  bool in_world = false;    ///< the axes are the world's (in orbit: inertial), not the link's
  Signals force, moment;    ///< [N], [N m] in time
};

/// A magnetic torquer: a rod on the free base with a dipole m d along a fixed direction d; torque m
/// d × B. The dipole is a signal, or it unloads wheels: m = (k/|B|²) d·(h × B), h the momentum of
/// the wheels in the base's axes, limited by L tanh(m/L). Three orthogonal rods give the torque -k
/// h⊥, h⊥ the part of h orthogonal to B. Source: Stickler, Alfriend 1976, J. Spacecraft 13(5), the
/// cross-product law.
struct Torquer {
  std::string name;
  Vec3d direction{1, 0, 0};         ///< in the base's axes; unit
  phs::FunctionPtr dipole;          ///< [A m²] in time; null: it unloads wheels
  double unload = 0;                ///< k [1/s]
  double limit = 0;                 ///< L [A m²]; 0: none
  std::vector<std::string> wheels;  ///< joints that rotate on the base
};

/// A soft latch: springs and dampers in six degrees of freedom between a frame on a link and one on
/// another body.
///
/// With A, B the frames' axes in the world (columns a_i, b_i) and d the vector from the origin of A
/// to that of B,
///   U = ¼ (dᵀA K Aᵀd + dᵀB K Bᵀd) + ½ Σ g_i |a_i - b_i|²,   g = ½ tr(Q) - Q_i,
/// where K has the stiffnesses along the axes and Q those about them. For small rotations θ, U is ½
/// dᵀKd + ½ θᵀQθ. It is symmetric in A and B, and smooth for rotations below π. Force and moment
/// are its exact gradients: one wrench on B and the opposite on A, so momenta are conserved to
/// rounding. The damper acts at the midpoint between the origins, on the twist of B relative to A
/// there. At rest both frames coincide. Source: the energy of rotation is -tr(G R) of Fasse,
/// Broenink 1997 (IEEE T. Robotics 13), as springs between the tips of the axes.
///
/// A line spring acts along d alone: U = ½ k (|d| - l)² with the damping c |d|'. It is a spring or
/// a tether between two points; where they meet it has no direction and no force.
struct SoftLatch {
  struct Line {
    double stiffness = 0, rest = 0, damping = 0;  ///< k [N/m], l [m], c [N s/m], >= 0
  };
  std::string name, link, body;  ///< body: "world" for a place fixed in the world
  Pose on_link{Mat3<double>::identity(), {0, 0, 0}}, on_body{Mat3<double>::identity(), {0, 0, 0}};
  Vec3d stiffness{0, 0, 0}, turning_stiffness{0, 0, 0};  ///< K [N/m], Q [N m/rad], >= 0
  Vec3d damping{0, 0, 0}, turning_damping{0, 0, 0};      ///< [N s/m], [N m s/rad], >= 0
  Line line{};
};

/// The parts of a spacecraft that act on its bodies.
struct Parts {
  std::vector<Thruster> thrusters = {};
  std::vector<Wrench> wrenches = {};
  std::vector<Torquer> torquers = {};
  std::vector<SoftLatch> latches = {};
  Vec3d field = {0, 0, 0};  ///< magnetic, constant in the world [T]; for torquers
  bool any() const { return pushes() > 0 || !latches.empty(); }
  /// Thrusters and wrenches, which have a force.
  size_t forces() const { return thrusters.size() + wrenches.size(); }
  size_t pushes() const { return forces() + torquers.size(); }
};

/// A wheel on the base: the coordinate of its joint, whose momentum p is that of the wheel, and its
/// axis in the base.
struct WheelAxis {
  int q;
  Vec3d axis;
};

/// A mechanism with such parts: a port-Hamiltonian system with the mechanism's state and joint
/// ports (followed by a body port "<latch>.on_link", "<latch>.on_body", "<thruster>.nozzle" or
/// "<wrench>.place" per attachment). Each latch is a storage "<name>" and a loss "<name>.damping";
/// each thruster, wrench and torquer is a source with its name. In addition, the impulse of each
/// source is integrated as observed powers "<name>.impulse.x" … [N s] (not of torquers) and
/// "<name>.angular_impulse.x" … [N m s, about the world's origin], in world axes: the momenta minus
/// these are conserved. Cost beyond the mechanism: one computation of body poses, and two passes
/// for body ports.
class PartsModel : public phs::ModelFor<PartsModel> {
 public:
  /// @throws InvalidArgument naming the part: unknown links, a latch between a body and itself,
  ///   numbers out of range, torquers without a free base or a field, wheels that do not turn on
  ///   the base
  PartsModel(std::shared_ptr<const mechanics::MechanicalModel> mechanical, Parts parts);

  const phs::Description& description() const override { return description_; }
  const mechanics::MechanicalModel& mechanical() const { return *with_ports_; }
  const Parts& parts() const { return parts_; }

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

  /// A frame on a body and its port, which has the frame's origin and the link's axes.
  struct Mount {
    int node;           ///< of the body; -1: fixed in the world, without a port
    Pose port;          ///< in the node's frame
    Mat3<double> axes;  ///< of the frame in the port's
    size_t u;           ///< offset of the port in the input
  };
  struct Placed {
    std::vector<Mount> pushed, a, b;             ///< pushed: by thrusters, then by wrenches
    std::vector<std::vector<WheelAxis>> wheels;  ///< per torquer
    size_t base_u = 0;  ///< torque on the free base, in the input; with torquers only
  };

 private:
  std::shared_ptr<const mechanics::MechanicalModel> mechanical_, with_ports_;
  Parts parts_;
  Placed placed_;
  phs::Description description_;
};

/// The accounts of thrusters, wrenches and torquers in a system's ledger, in this order: works,
/// then impulses.
std::vector<phs::PowerAccount> push_accounts(const Parts& parts);

/// Torque of a rod on the base, in its axes [N m]. B: the field there in the same axes [T]; x: the
/// state, whose first nq numbers are positions.
template <class T>
Vec3<T> torque_of(const Torquer& rod, const std::vector<WheelAxis>& wheels, const T& t,
                  std::span<const T> x, size_t nq, const Vec3<T>& B);

/// The sum of signals at t.
template <class T>
Vec3<T> at_time(const Wrench::Signals& signals, const T& t) {
  Vec3<T> sum{T(0.0), T(0.0), T(0.0)};
  for (const auto& term : signals) sum = sum + (*term.size)(t)*Vec3<T>(term.along);
  return sum;
}

/// Axes and momenta of wheels on the free base, by the names `joints`. @throws InvalidArgument
/// beginning with `who` for a joint that does not rotate on it
std::vector<WheelAxis> wheel_axes(const mechanics::Mechanism& m, const std::string& who,
                                  const std::vector<std::string>& joints);

}  // namespace porthos::space
