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

/// The centre of mass of all that floats in a scene where nothing from outside acts but uniform
/// gravity. It moves in closed form, R(t) = R + V t + g t²/2, and is taken out of the equations:
/// a run integrates the motion relative to it, whose linear momentum is zero and whose bits do not
/// depend on R, V and g. Results show places and momenta in the world again (WorldView). Why this
/// is exact: docs/mathematics.md.
struct CentreOfMass {
  using Real = long double;  ///< what moves the whole and what moves inside are added in 64 bits
  using Vec = mechanics::Vec3<Real>;

  Vec start{0, 0, 0}, start_velocity{0, 0, 0};  ///< R, V: at t = 0, world axes [m, m/s]
  Vec gravity{0, 0, 0};                         ///< g [m/s²]
  double mass = 0;                              ///< [kg]

  Vec position(double t) const {
    return start + Real(t) * (start_velocity + Real(t / 2) * gravity);
  }
  Vec velocity(double t) const { return start_velocity + Real(t) * gravity; }
  double kinetic_J(double t) const {
    return double(Real(mass) / 2 * dot(velocity(t), velocity(t)));
  }
  double work_of_gravity_J(double t) const {
    return double(Real(mass) * dot(gravity, position(t) - start));
  }
  /// The momentum of everything in the world, about its origin, from that about the centre of mass.
  mechanics::Momentum<double> in_world(double t, const mechanics::Momentum<double>& m) const;
};

/// Why the centre of mass of a scene stays in the equations: one clause; empty where it is out.
std::string why_centre_stays(const Scene& scene);

/// Whether the total linear momentum is what it should be by the structure of the state, so that no
/// method can be wrong about it: the centre of mass is out and there is one tree.
bool linear_momentum_is_structure(const Assembly& a);

/// Moves a start q, v of a floating mechanism into the frame of its centre of mass. Returns that of
/// the start, without gravity.
CentreOfMass take_centre_out(const mechanics::Mechanism& m, std::span<double> q,
                             std::span<double> v);
/// Leaves no rounding in the linear momentum of a state of that frame: it is zero.
void settle_momentum(const mechanics::Mechanism& m, phs::State& s);

/// States of an assembly as the world sees them. All momenta of a tree contain its velocity, so
/// each state costs one momentum pass. Not for two threads at once.
class WorldView {
 public:
  explicit WorldView(const Assembly& a);
  /// The state at time t [s], until the next call; `s` itself where the centre of mass is not
  /// apart.
  const phs::State& operator()(double t, const phs::State& s);
  /// What the centre of mass added to the rates v in the last call; empty where it is not apart.
  std::span<const CentreOfMass::Real> added_rates() const { return v_; }

 private:
  std::shared_ptr<const mechanics::Mechanism> mechanism_;
  std::optional<CentreOfMass> centre_;
  std::optional<mechanics::Workspace<CentreOfMass::Real>> workspace_;
  std::vector<CentreOfMass::Real> q_, v_, p_;
  phs::State world_;
};

}  // namespace porthos::scene
