#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "phs/system/system.h"

namespace porthos::phs {

/// The multipliers of a system's constraints at a state, from the accelerations:
///   D λ = d/dt(Bᵀe + ∂g/∂t) along the field without constraint forces.
/// That derivative is exact, by duals. Methods keep impulses, which are means of λ near a node;
/// this is λ at an instant, for outputs.
class Reactions {
 public:
  /// model: with constraints; it must outlive this object.
  /// @throws InvalidArgument if it has none
  explicit Reactions(const Model& model);
  ~Reactions();

  /// The multipliers at time t and the state x (size nx, on the manifold). Forces on the system are
  /// -Bλ. Where they are not unique, some of them. Allocates nothing. @return one per row, valid
  /// until the next call
  std::span<const double> at(double t, std::span<const double> x,
                             std::span<const std::int64_t> turns = {});
  /// The same at the state's turn angles of set_turn_angles(), where the field without constraint
  /// forces is given. @param rate  system().field(t, x), size nx
  /// @param stabilisation  a [1/s]: g'' + 2a g' + a² g = 0 instead of g'' = 0 (Baumgarte 1972);
  ///   off the manifold the multipliers then do work
  std::span<const double> along(double t, std::span<const double> x, std::span<const double> rate,
                                double stabilisation = 0);
  /// As System::set_turn_angles, for along().
  void set_turn_angles(std::span<const double> angles);
  /// B λ of the last multipliers: the constrained motion is x' = field - Bλ. Written, size nx.
  void forces(std::span<double> Bl) { rows_->forces(lambda_, Bl); }
  /// What the multipliers exert, see ConstraintBlock::reactions; the shortest ones where they are
  /// not unique. Valid until the next call. Allocates where rows depend on each other.
  std::span<const double> exerted();
  /// Sets the values that sampled controllers hold, those of all Model::holds() in turn. Until then
  /// they are those of the model.
  void hold(std::span<const double> values);
  /// Whether the multiplier of a row at the last state has only one value.
  bool unique(int row) const { return rows_->unique(row); }
  const Description& description() const { return system_->description(); }
  int rank() const { return rows_->rank(); }

 private:
  std::unique_ptr<System<double>> system_;
  std::unique_ptr<System<Dual>> moving_;
  std::unique_ptr<Constraints<double>> rows_;
  std::unique_ptr<Constraints<Dual>> moving_rows_;
  std::vector<double> field_, lambda_, g_, angles_, exerted_;
  std::vector<HoldPtr> holds_;
  std::vector<std::shared_ptr<std::vector<double>>> held_;  ///< of hold(); empty before
  std::vector<Dual> x_, e_, rate_, dual_angles_;
};

}  // namespace porthos::phs
