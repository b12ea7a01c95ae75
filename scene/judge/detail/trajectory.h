#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/assemble/assembly.h"
#include "scene/assemble/centre_of_mass.h"
#include "scene/judge/trajectory_map.h"
#include "scene/judge/trajectory_table.h"
#include "scene/run/row_times.h"

/// A trajectory of another program, as states of a model. Private to the judge.
namespace porthos::scene {

using Numbers = std::vector<double>;

Numbers times_of_rows(const TrajectoryTable& table, const TrajectoryMap& map);
/// Whether the file has the pose of a free base.
bool has_base(const TrajectoryTable& table, const TrajectoryMap& map);

struct RatesAgreement;

/// A trajectory of another program as states of the model.
class Trajectory {
 public:
  Trajectory(const TrajectoryTable& table, const TrajectoryMap& map, const Assembly& a);
  const std::vector<std::string>& torques() const { return torques_; }

  /// A row of the file: as recorded, and as judged. They differ if the centre of mass is taken out
  /// (centre_of_mass.h).
  struct Row {
    phs::State world, inner;
    CentreOfMass centre;
  };
  /// h: time since the previous row [s]. Rows must be requested in order.
  Row row(const phs::Description& d, size_t i, double h, bool centre_out);
  /// Norm error of the attitudes in the file, before normalisation.
  double norm_error() const { return norm_error_; }

  /// A way between two rows that the rates there do not tell of, not even with an impact between.
  struct Leap {
    size_t from = 0, to = 0;      ///< rows; apart where the values between them are held
    double moved = 0, told = 0;   ///< by positions, by rates
    double off = 0, allowed = 0;  ///< their difference
    bool rare = true;             ///< fewer than one row in 20 of that coordinate leap
  };
  /// Positions against rates, of a joint of one freedom, an attitude or the place of a free base,
  /// over all rows but holes. Of an attitude: lengths of rotation vectors from row to row.
  struct Agreement {
    std::string name;
    double way = 0;        ///< Σ |q_i - q_(i-1)|
    double off = 0;        ///< Σ of what the trapezoidal rule over the rates leaves of it
    double uncertain = 0;  ///< Σ of that rule's own errors and of the rounding of the numbers
    double rates = 0, changes = 0;  ///< Σ of their sizes, and of their differences by row
    double hidden = 0;              ///< most turns between two rows that the rates alone tell of
    std::optional<Leap> leap = {};  ///< the worst, if they are few

    /// A way that angles do not show, by the rates: with another unit of time it would fit too.
    void hide(double moved, double shown) {
      if (std::fabs(moved) < M_PI || std::fabs(moved - shown) < M_PI) return;
      uncertain += std::fabs(moved);
      hidden = std::max(hidden, std::fabs(moved) / (2 * M_PI));
    }
  };
  std::vector<Agreement> agreements(const Rows& rows) const;
  RatesAgreement agreement(const Rows& rows) const;

  /// Whether the file has rates, not momenta.
  bool has_rates() const { return by_rates_; }
  /// The coordinates of joints of one degree of freedom.
  std::vector<std::string> joints() const;
  /// The first row whose angle is known modulo a turn only, as it may have been given so and turns
  /// by more than half a turn meanwhile. After all rows.
  struct UnknownTurns {
    size_t angle = 0, row = 0;  ///< in the order of State::turns
    std::string name;
    double turns = 0;  ///< that its rates reach since the row before
  };
  std::vector<UnknownTurns> unknown_turns(const Rows& rows) const;
  /// Whether there is a coordinate of that kind.
  bool has(phs::BlockKind kind) const;
  /// The same rows in other units: by what their numbers are multiplied.
  struct Units {
    double angles = 1, angle_rates = 1;  ///< of joints
    double attitude_rates = 1;
    double lengths = 1, velocities = 1;
  };
  Trajectory in_units(const Units& units) const;
  /// The same rows, if the positions or rates of two joints stand in each other's place.
  Trajectory exchanged(const std::string& a, const std::string& b, bool positions,
                       bool rates) const;
  /// The same, if two axes (0 to 2) of all places do.
  Trajectory with_axes_exchanged(size_t a, size_t b, bool positions, bool rates) const;
  /// The same, if attitudes are x y z w.
  Trajectory with_scalar_last() const;
  /// The axes of the rates of free bases.
  struct RateAxes {
    bool linear_in_body = false, angular_in_world = false;  ///< as TrajectoryMap
  };
  RateAxes rate_axes() const { return axes_; }
  /// The same rows with rates along other axes.
  Trajectory with_rates_along(RateAxes axes) const;

  /// Works of the torques from row i - 1 to row i [J], as the map says they go between rows.
  void works(const Numbers& t, size_t i, std::span<double> to) const;
  using Between = TrajectoryMap::TorqueBetween;
  /// Of all torques, from each row before it to the rows of that stride [J]. After all rows.
  Numbers works_over(const Numbers& t, Between between, size_t stride) const;

 private:
  struct Columns {
    mechanics::JointCoordinates c;
    std::vector<Numbers> q, v, p;
    Numbers torque;
    Numbers turns;         ///< by row, of a run of Porthos; else empty
    bool wrapped = false;  ///< an angle that may be given modulo a turn: its rates count its turns
  };
  void find_turns(Columns& k, size_t angle) const;
  [[noreturn]] void missing(const mechanics::JointCoordinates& c, const char* kind) const;
  void normalise(double* xi, size_t i);
  /// Rotates rates of free bases into the base's own axes: [angular; linear of its origin].
  void turn_rates(const Numbers& q, Numbers& v) const;
  phs::State state(const phs::Description& d, Numbers x, size_t i) const;
  /// Turns of the angles that a file gives modulo 2π: its own, or those that the rates tell of.
  void follow(size_t i, double h);
  std::vector<Numbers> velocity_in_world(const Columns& place) const;
  Agreement agreement_of_attitude(const Columns& k, const Rows& rows) const;
  /// Displacement of a joint of one degree of freedom from row i - 1 to row i, turns included.
  double distance(const Columns& k, size_t i, double h) const;
  double work(const Columns& k, const Numbers& t, size_t from, size_t to, Between between) const;

  const TrajectoryTable& table_;
  const TrajectoryMap& map_;
  const mechanics::Mechanism& m_;
  const mechanics::MechanicalModel& model_;
  std::vector<Columns> columns_;
  std::vector<std::string> torques_;
  std::vector<std::int64_t> lost_;  ///< turns, by angle
  bool by_rates_ = false, by_momenta_ = false;
  RateAxes axes_;
  double norm_error_ = 0;
};

/// The coordinate whose positions and rates disagree most.
struct RatesAgreement {
  std::string name;                             ///< empty: none can be checked
  double value = 0, limit = 0;                  ///< what the rates leave of its way, and may leave
  std::optional<Trajectory::Agreement> coarse;  ///< one whose rows are too few to tell
  double hidden = 0;                            ///< most turns between two rows, of all
  std::optional<Trajectory::Leap> leap;         ///< the worst of all
  std::string leaps;                            ///< the coordinate of that
  bool fits() const { return value <= limit; }  ///< on the whole
  bool holds() const { return fits() && !leap; }
};

}  // namespace porthos::scene
