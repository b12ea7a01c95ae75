#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "phs/system/state.h"

namespace porthos::scene {

struct Scene;
struct Assembly;

/// The centre of mass of all floating bodies in a scene where uniform gravity is the only external
/// force. It moves in closed form, R(t) = R + V t + g t²/2, and is taken out of the equations: a
/// run integrates the motion relative to it, whose linear momentum is zero and whose bits do not
/// depend on R, V and g. Results show positions and momenta in the world again (WorldView).
/// docs/mathematics.md shows why this is exact.
struct CentreOfMass {
  using Real = long double;  ///< common and internal motion are added with 64 bits
  using Vec = mechanics::Vec3<Real>;

  Vec start{0, 0, 0}, start_velocity{0, 0, 0};  ///< R, V: at t = 0, world axes [m, m/s]
  Vec gravity{0, 0, 0};                         ///< g [m/s²]
  double mass = 0;                              ///< [kg]

  Vec position(double t) const {
    return start + Real(t) * (start_velocity + Real(t / 2) * gravity);
  }
  Vec velocity(double t) const { return start_velocity + Real(t) * gravity; }
  bool moves() const { return dot(start_velocity, start_velocity) + dot(gravity, gravity) > 0; }
  double kinetic_J(double t) const {
    return double(Real(mass) / 2 * dot(velocity(t), velocity(t)));
  }
  double work_of_gravity_J(double t) const {
    return double(Real(mass) * dot(gravity, position(t) - start));
  }
  /// The total momentum about the world's origin, from the momentum m about the centre of mass.
  mechanics::Momentum<double> in_world(double t, const mechanics::Momentum<double>& m) const;
};

/// The reason why the centre of mass of a scene stays in the equations: one clause; empty if it is
/// taken out.
std::string why_centre_stays(const Scene& scene);

/// Whether the structure of the state makes the total linear momentum exact for every method: the
/// centre of mass is taken out and there is one tree.
bool linear_momentum_is_structure(const Assembly& a);

/// Moves a start q, v of a floating mechanism into the frame of its centre of mass. Returns the
/// centre of mass of the start, without gravity.
CentreOfMass take_centre_out(const mechanics::Mechanism& m, std::span<double> q,
                             std::span<double> v);
/// Removes the rounding error in the linear momentum of a state of that frame, which is zero.
void settle_momentum(const mechanics::Mechanism& m, phs::State& s);

/// States of an assembly in the world frame. All momenta of a tree contain its velocity, so each
/// state costs one momentum pass. Not thread-safe.
class WorldView {
 public:
  explicit WorldView(const Assembly& a);
  /// The state at time t [s], valid until the next call; `s` itself if the centre of mass is not
  /// taken out.
  const phs::State& operator()(double t, const phs::State& s);
  /// The contribution of the centre of mass to the rates v in the last call; empty if it is not
  /// taken out.
  std::span<const CentreOfMass::Real> added_rates() const { return v_; }

 private:
  std::shared_ptr<const mechanics::Mechanism> mechanism_;
  std::optional<CentreOfMass> centre_;
  std::optional<mechanics::Workspace<CentreOfMass::Real>> workspace_;
  std::vector<CentreOfMass::Real> q_, v_, p_;
  phs::State world_;
};

}  // namespace porthos::scene
