#pragma once
#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "mechanics/constraints/constraint_spec.h"
#include "phs/linear_algebra/block_pattern.h"
#include "phs/system/constraints.h"

namespace porthos::mechanics {

class PlaneCurve;

/// Rows of a loop joint, rod or rolling body; d: origin of b in a; R: axes of b in a.
enum class Row {
  dx,
  dy,
  dz,  ///< a component of d
  xz,
  yz,
  zx,        ///< x_a·z_b, y_a·z_b, z_a·x_b
  weld,      ///< three rows: twice the vector part of the quaternion of R
  curve,     ///< signed distance of (d_x, d_y) from a curve
  screw,     ///< pitch sin(angle - d_z/pitch): periodic, so it counts no turns
  distance,  ///< (d·d - l²)/(2 l)
  disk,      ///< three rows: the height of the rim, and its slip along x_a and y_a
  sphere,    ///< three rows, likewise of a ball
  blade,     ///< the velocity along z_b
  spin       ///< the angular velocity along z_b
};

/// The rows of a joint type between two links. @throws InvalidArgument for a type without rows,
/// with a list of the others
std::span<const Row> rows_of(std::string_view joint_type);
/// The rows of Rolling::type. @throws InvalidArgument likewise
std::span<const Row> rolling_rows(std::string_view type);
/// The number of rows in a list (a weld, a disk and a sphere count three).
int count_rows(std::span<const Row> rows);

/// The constraints of one mechanism, resolved and checked: an immutable value, shared by threads.
class ConstraintSet {
 public:
  /// A loop joint, rod or rolling body (b, on the ground a). Paths hold node indices from the body
  /// up to below the lowest common ancestor; joints above it do not move the two frames against
  /// each other.
  struct Loop {
    std::span<const Row> rows;
    int at;               ///< offset of its rows
    int size;             ///< number of its rows
    int node_a, node_b;   ///< -1: the world
    Pose pose_a, pose_b;  ///< in the frames of the nodes
    std::vector<int> path_a, path_b;
    std::vector<int> above;  ///< all ancestors of both nodes, themselves included, leaves first
    double pitch, length;    ///< length: of a rod, or the radius
    std::shared_ptr<const PlaneCurve> curve;  ///< null: none
    bool is_rod() const { return rows.front() == Row::distance; }
  };
  struct Term {
    int node, q, v, turn;  ///< turn: index among the angle blocks, -1 if none
    double factor;
  };
  struct Coupled {
    int at;
    double offset;
    std::vector<Term> terms;
    std::vector<int> above;               ///< as of a loop
    phs::FunctionPtr position = nullptr;  ///< what a driven coordinate follows, instead of offset
    phs::FunctionPtr rate = nullptr;      ///< its derivative
  };
  /// @throws InvalidArgument naming the constraint: an empty or duplicate name, an unknown link,
  ///   type or coordinate, two frames that no joint moves against each other, a length, radius or
  ///   pitch that is not finite and > 0 (pitch: not 0), points of no curve (plane_curve.h), a
  ///   coupling without terms, a coordinate with several freedoms
  ConstraintSet(const Mechanism& mechanism, const ConstraintSpec& spec);

  int count() const { return count_; }  ///< rows
  const std::vector<Loop>& loops() const { return loops_; }
  /// Couplings, then driven coordinates.
  const std::vector<Coupled>& couplings() const { return couplings_; }
  /// All nodes below which a constraint acts, leaves first. @param block  index among blocks()
  std::span<const int> above(int block) const;
  /// Pairs of blocks that share a moving ancestor, each once: where D has elements besides those of
  /// a block with itself.
  std::span<const std::pair<int, int>> neighbours() const { return neighbours_; }
  /// How D is factored. Independent loops, and those in chains, cost O(N).
  const phs::BlockPattern& pattern() const { return pattern_; }
  /// Loops, rods, rolling bodies, couplings, driven coordinates, each in the order given. A loop
  /// and a rolling body exert the wrench [moment; force] on b about the origin of its frame, in the
  /// axes of a [N m; N]; a rod its tension [N]; a coupling and a motor the torque or force on each
  /// of their coordinates, "<name>.<coordinate>".
  const std::vector<phs::ConstraintBlock>& blocks() const { return blocks_; }
  const ConstraintSpec& spec() const { return spec_; }
  /// Whether one acts between a link and the world, so that momenta change.
  bool on_the_world() const;

 private:
  void add_block(const std::string& name, const std::string& kind, int size,
                 std::vector<phs::ConstraintBlock::Reaction> reactions);
  void add_loop(const Mechanism& m, const std::string& name, const std::string& kind,
                const LinkFrame& a, const LinkFrame& b, std::span<const Row> rows, double pitch,
                double length, std::shared_ptr<const PlaneCurve> curve = nullptr);
  void add_coupling(const Mechanism& m, const Coupling& c);
  void add_driven(const Mechanism& m, const Driven& d);
  static void add_term(const Mechanism& m, const std::string& name, const Coupling::Term& t,
                       Coupled& to, std::vector<phs::ConstraintBlock::Reaction>& reactions);
  void find_pattern(const Mechanism& m);

  ConstraintSpec spec_;
  int count_ = 0;
  std::vector<Loop> loops_;
  std::vector<Coupled> couplings_;
  std::vector<std::pair<int, int>> neighbours_;
  std::vector<phs::ConstraintBlock> blocks_;
  phs::BlockPattern pattern_;
};

/// The evaluator of a set of constraints in the scalar T. Mechanism and set must outlive it.
/// Source: Delassus matrix by one sweep per row with the articulated factor: docs/constraints.md.
template <class T>
std::unique_ptr<phs::Constraints<T>> make_constraints(const Mechanism& m, const ConstraintSet& set);

}  // namespace porthos::mechanics
