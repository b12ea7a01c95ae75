#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "mechanics/momentum.h"
#include "scene/assemble/assembly.h"

namespace porthos::scene {

/// The measurements of a state, relative to the start of the run.
struct Measured {
  double energy_change_J = 0;    ///< H - H(start)
  std::vector<double> stored_J;  ///< of each of the system's storages
  /// momentum - momentum(start), world axes; 0 where not an invariant. The angular momentum is
  /// about the centre of mass at the start, so a position far from the origin does not multiply the
  /// state's rounding by a lever arm.
  std::array<double, 3> linear{}, angular{};
  double quaternion_norm = 0;            ///< largest | |ξ| - 1 |
  double gap = 0, slip = 0;              ///< of constraints: largest |g| and |g'| [m | rad], [/s]
  mechanics::MomentumScale scale{0, 0};  ///< of this state, see Meter::measure
  bool finite() const;
};

/// Number of steps between measurements that are made between records. A measurement takes about as
/// long as seven evaluations of the field (with 64 bits, without SIMD), so measurements take two or
/// three percent of a run, explicit or implicit. The number depends on counts alone, so a run is
/// measured at the same steps on every machine.
inline std::int64_t steps_to_a_look(const integrators::Cost& c) {
  return c.evaluations >= 16 * c.steps ? 16 : 64;
}

/// The same in lanes, where a step costs a fraction but a measurement does not: as rarely as for
/// explicit methods.
inline constexpr std::int64_t steps_to_a_look_in_lanes = 64;

/// Measures states in extended precision from value + low word, so that the measurement adds no
/// noise. The next measurement overwrites the returned object.
class Meter {
 public:
  explicit Meter(const Assembly& assembly);

  /// Measures everything, for a record.
  const Measured& measure(double t, const phs::State& state);
  /// The same without the scale of the momenta, which stays that of the last record. Allocates
  /// nothing.
  const Measured& look(double t, const phs::State& state);

  double initial_J() const { return double(start_.energy); }
  /// Whether the momentum is an invariant of the system.
  bool has_linear() const { return linear_.at >= 0; }
  /// See linear_momentum_is_structure().
  bool linear_is_structure() const { return linear_is_structure_; }
  bool has_angular() const { return angular_.at >= 0; }
  bool has_rotations() const { return !norms_at_.empty(); }
  /// Rows of the system's constraints.
  int constraint_rows() const { return rows_ ? rows_->count() : 0; }

  /// Sizes of the momenta at the start, angular as in Measured; both may be 0.
  mechanics::MomentumScale momentum_at_start() const { return size_; }

 private:
  using Real = long double;
  using Vector = std::array<Real, 3>;
  struct Values {
    Real energy = 0;
    Vector linear{}, angular{};
    double quaternion_norm = 0;
    double gap = 0, slip = 0;
  };
  /// Measures positions from the centre of mass of free bodies in free space. Their invariants do
  /// not depend on the position, so a position far from the origin costs no digits.
  void measure_from_centre(const phs::State& start);
  void read(const phs::State& state);  ///< sets x_ and the turns of the system
  Values values();                     ///< of x_; leaves stored_
  void measure_constraints(Values& v);
  mechanics::MomentumScale scale_of(const phs::State& state);

  std::shared_ptr<const phs::Model> model_;
  std::shared_ptr<const mechanics::MechanicalModel> mechanical_;  ///< may be null
  std::unique_ptr<phs::System<Real>> system_;
  std::optional<mechanics::Workspace<double>> workspace_;
  std::unique_ptr<phs::Constraints<Real>> rows_;  ///< null: none
  std::vector<Real> x_, turn_angles_, stored_, invariants_;
  std::vector<Real> g_, e_;  ///< rows and efforts
  std::vector<std::int64_t> turns_;
  /// Where an invariant lies: of a planar system a momentum has fewer than three numbers.
  struct Place {
    int at = -1, size = 0;
  };
  Place linear_, angular_;
  std::vector<size_t> norms_at_;
  bool linear_is_structure_ = false;
  struct Shift {
    size_t at;
    Real by;
  };
  std::vector<Shift>
      shifts_;  ///< of positions of free bodies: measured from the centre of mass at the start
  Values start_;
  mechanics::MomentumScale size_{0, 0};
  Measured now_;
};

}  // namespace porthos::scene
