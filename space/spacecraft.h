#pragma once
#include <memory>

#include "mechanics/mechanical_model.h"
#include "space/gravity_gradient.h"
#include "space/orbit.h"
#include "space/parts.h"

/// A spacecraft in orbit, split into the motion of its centre of mass and everything else.
namespace porthos::space {

/// The state: first that of the internal model, a mechanism on a free base with everything joined
/// to it (beginning with its q and p, see mechanics::MechanicalModel), then position and velocity
/// of the centre of mass, "orbit.position" and "orbit.velocity" [m, m/s].
///
/// The linear momentum of the internal motion is zero and stays exactly zero, because it is motion
/// relative to the centre of mass. "base.position" is the base's origin relative to that point. A
/// body that floats beside the base, before a capture or after a release, belongs to the whole and
/// has its position relative to the same point. The kinetic energy separates exactly, T = |P|²/2m +
/// T_int(attitude, joints). The port-Hamiltonian system declared here is the *internal* one. H is
/// its energy, and the gravity gradient is a source, "gravity_gradient", whose power is supplied by
/// the orbit. There is no total of orbital and internal energy, because one rounding of 7e10 J is
/// 1e-5 J, as much as an arm's motion in a year. The angular momentum of the internal motion is
/// that about the centre of mass; in orbit it is no invariant.
class Spacecraft : public phs::ModelFor<Spacecraft> {
 public:
  /// The powers of the internal model are followed by "gravity_gradient" and, with plates,
  /// "plates". internal: `mechanical` itself or a model whose state begins with its state.
  /// @throws InvalidArgument as GravityGradient and OrbitMotion
  Spacecraft(std::shared_ptr<const mechanics::MechanicalModel> mechanical,
             std::shared_ptr<const phs::Model> internal, Environment environment, Parts parts = {});

  const phs::Description& description() const override { return description_; }
  const mechanics::MechanicalModel& mechanical() const { return *mechanical_; }
  const phs::Model& internal() const { return *internal_; }
  const Mechanism& mechanism() const { return mechanical_->mechanism(); }
  const OrbitMotion& orbit() const { return orbit_; }
  /// Thrusters and torquers, which act in the kicks of the splitting (push.h).
  const Parts& parts() const { return parts_; }
  std::vector<phs::HoldPtr> holds() const override { return internal_->holds(); }
  size_t internal_size() const { return size_t(internal_->description().nx); }

  /// The whole state from an internal one, whose motion is taken relative to the centre of mass,
  /// and the orbit `centre` of that point. Positions and linear momenta of base and free bodies in
  /// `internal` are replaced by those relative to the common centre of mass.
  /// @throws InvalidArgument for a body further than 1e-3 of |R| away, where the expansion of
  /// gravity about that point fails
  std::vector<double> state(std::span<const double> internal,
                            const PointState<double>& centre) const;

  template <class T>
  std::unique_ptr<phs::System<T>> make_system() const;

 private:
  std::shared_ptr<const mechanics::MechanicalModel> mechanical_;
  std::shared_ptr<const phs::Model> internal_;
  OrbitMotion orbit_;
  Parts parts_;
  phs::Description description_;
};

}  // namespace porthos::space
