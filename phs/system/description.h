#pragma once
#include <string>
#include <vector>

/// The description of a port-Hamiltonian system: the meaning of its state numbers, its ports and
/// its invariants.
namespace porthos::phs {

/// linear: any real number. angle: 2π-periodic, kept in (-π, π] plus a turn count (State::turns).
/// rotation: a quaternion (w, x, y, z), body to parent; its conjugate block is its T*R⁴ lift π.
enum class BlockKind { linear, angle, rotation };

/// A slice of the state vector.
struct Block {
  std::string name;  ///< e.g. "joint_1"
  BlockKind kind;
  int at;             ///< offset of the slice in x
  int size;           ///< 1 for an angle, 4 for a rotation
  int momentum = -1;  ///< offset of the conjugate slice, or -1 if there is none
  std::string unit;   ///< "rad", "m", "1", ...
  std::string momentum_unit;
};

/// effort_in: a force or torque is the input, a rate the output. flow_in: the other way round.
enum class PortKind { effort_in, flow_in };

/// A power port. Sign: u . y is the power flowing *into* the system [W].
struct Port {
  std::string name;  ///< "joint_1.torque"
  PortKind kind;
  int size;
  int at;  ///< offset of this port in u and in y
  std::string input_unit, output_unit;
  bool required = false;  ///< must be joined: Network::build() refuses it open
};

/// A power that changes the stored energy. supplied adds energy, dissipated removes it (heat; never
/// negative if passive). observed is no part of this balance: it is integrated for the ledger of
/// another system.
enum class PowerKind { supplied, dissipated, observed };
struct PowerAccount {
  std::string name;  ///< "elbow.damping", "motor.supply", ...
  PowerKind kind;
  bool control = false;  ///< a controller's power: may be checked for passivity
};

/// A quantity that the unforced, undamped field conserves. degree: 1 linear in x, 2 quadratic in x,
/// 0 any other function.
struct Invariant {
  std::string name;  ///< "angular_momentum", "quaternion_norm.base", ...
  int size, at;      ///< number of components, offset in the vector of all invariants
  int degree;
  std::string unit;
};

/// A part of H whose flow the system can compute exactly, for splitting methods.
struct PartialFlow {
  std::string name;  ///< "kinetic", "potential", "kepler", ...
};

/// Rows of constraints that belong together: a loop joint, a gear, a rod
/// (phs/system/constraints.h).
struct ConstraintBlock {
  /// Something that the block exerts (Constraints::exerted), for results.
  struct Reaction {
    std::string name;  ///< "rocker_pin", "gear.input"
    int size;
    std::string unit;
  };
  std::string name;  ///< "rocker_pin"
  std::string kind;  ///< "revolute", "coupling", "rod", ...
  int size;          ///< rows
  int at;            ///< offset of its rows in g and λ
  int power = -1;    ///< its account in Description::powers; -1: none
  std::vector<Reaction> reactions = {};
  bool rolling = false;               ///< some rows restrict rates and no positions
  bool moving = false;                ///< g depends on time
  std::vector<double> instants = {};  ///< then: times at which a derivative of it jumps [s]
};

/// Structural properties that a system claims. check() tests them and methods rely on them.
struct Traits {
  bool autonomous = true;
  bool canonical = false;  ///< x = (q, p) in two halves and J = [0 I; -I 0]
  bool separable = false;  ///< H = T(p) + V(q)
  bool quadratic = false;  ///< H has at most degree two in the momenta that blocks name
  bool lossless = true;    ///< R = 0
};

/// A system's name, state, ports, powers and invariants.
struct Description {
  std::string name;
  int nx = 0;  ///< numbers in the state
  int nu = 0;  ///< numbers in the input, and in the output
  std::vector<Block> blocks;
  std::vector<Port> ports;
  std::vector<Invariant> invariants;  ///< besides H
  Traits traits;
  std::vector<PartialFlow> flows = {};  ///< in the order a splitting composes them; empty: none

  /// The energy balance: d/dt Σ storages = Σ supplied - Σ dissipated.
  std::vector<std::string> storages = {"energy"};  ///< parts of H
  std::vector<PowerAccount> powers = {};           ///< with all open ports at u = 0

  /// 0 = g(x), which no method keeps by itself: only those with Declaration::constraints.
  std::vector<ConstraintBlock> constraints = {};

  int angle_count() const {
    int n = 0;
    for (const auto& b : blocks) n += b.kind == BlockKind::angle;
    return n;
  }
  int constraint_count() const {
    int n = 0;
    for (const auto& c : constraints) n += c.size;
    return n;
  }
  /// Numbers of Constraints::exerted.
  int reaction_count() const {
    int n = 0;
    for (const auto& c : constraints)
      for (const auto& r : c.reactions) n += r.size;
    return n;
  }
  int invariant_count() const {
    int n = 0;
    for (const auto& i : invariants) n += i.size;
    return n;
  }
};

}  // namespace porthos::phs
