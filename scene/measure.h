#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "mechanics/momentum.h"
#include "scene/scene.h"

namespace porthos::scene {

/// What a state says against the start of the run.
struct Measured {
  double energy_change_J = 0;    ///< H - H(start)
  double kinetic_J = 0;          ///< of the mechanism; without one, the largest stored energy
  std::vector<double> stored_J;  ///< of each of the system's storages
  /// momentum - momentum(start), world axes; 0 where not an invariant
  std::array<double, 3> linear{}, angular{};
  double quaternion_norm = 0;            ///< largest | |ξ| - 1 |
  mechanics::MomentumScale scale{0, 0};  ///< of this state, where the start has none (see Meter)
  bool finite() const;
};

/// Measures states in extended precision from value + low word, so that a measurement adds no noise
/// of its own.
class Meter {
 public:
  explicit Meter(const Assembly& assembly);

  Measured operator()(const phs::State& state);

  double initial_J() const { return to_double(start_.energy); }
  double kinetic_at_start_J() const { return kinetic_at_start_; }
  /// Whether the momentum is an invariant of the system.
  bool has_linear() const { return linear_at_ >= 0; }
  /// See linear_momentum_is_structure().
  bool linear_is_structure() const { return linear_is_structure_; }
  bool has_angular() const { return angular_at_ >= 0; }
  bool has_rotations() const { return !norms_at_.empty(); }

  /// Larger of the momentum at the start and Σ|m_i||v_i| (Σ|I_i||ω_i| + |m_i||c_i||v_i|) there;
  /// both may be 0.
  mechanics::MomentumScale momentum_at_start() const { return size_; }

 private:
  using Real = long double;
  struct Values {
    Real energy = 0;
    std::vector<Real> invariants;
  };
  static double to_double(Real x) { return static_cast<double>(x); }
  void read(const phs::State& state);  ///< sets x_ and the turns of the system
  Values values();                     ///< of x_
  double kinetic(const phs::State& state, const std::vector<double>& stored);
  mechanics::MomentumScale scale_of(const phs::State& state);

  std::shared_ptr<const phs::Model> model_;
  std::shared_ptr<const mechanics::MechanicalModel> mechanical_;  ///< may be null
  std::unique_ptr<phs::System<Real>> system_;
  std::optional<mechanics::Workspace<double>> workspace_;
  std::vector<Real> x_, turn_angles_, stored_;
  std::vector<std::int64_t> turns_;
  int linear_at_ = -1, angular_at_ = -1;
  std::vector<size_t> norms_at_;
  bool linear_is_structure_ = false;
  bool starts_at_rest_ = false;
  Values start_;
  double kinetic_at_start_ = 0;
  mechanics::MomentumScale size_{0, 0};
};

}  // namespace porthos::scene
