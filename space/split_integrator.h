#pragma once
#include <functional>

#include "integrators/core/integrator.h"
#include "space/ledgers.h"
#include "space/plates.h"
#include "space/push.h"
#include "space/spacecraft.h"

namespace porthos::space {

/// The methods of the two motions, and their composition.
struct SplitOptions {
  std::string splitting = "lobatto4";  ///< see split_schemes()
  std::string method = "gauss16";      ///< of the internal motion
  integrators::Options options = {};   ///< of that method
  /// Makes the method of the internal motion, a model, with its step; empty: that of the name.
  std::function<std::unique_ptr<integrators::Integrator>(const phs::Model& internal, double h)>
      make = {};
  std::unique_ptr<integrators::Integrator> method_for(const phs::Model& internal, double h) const {
    return make ? make(internal, h) : integrators::make_integrator(method, internal, h, options);
  }
};

/// Orbit ⊕ internal motion ⊕ coupling, a splitting of the type of Wisdom and Holman (1991). The
/// centre of mass drifts by the exact Kepler flow, while a method of the catalogue steps the
/// internal motion. In between, kicks at fixed positions apply everything that couples them or
/// perturbs the orbit. The internal motion determines the step size, not the orbit. The uncorrected
/// scheme adds c h² Fᵀ M⁻¹ F with F = -∂V/∂q to the energy that it conserves. A corrected scheme
/// removes this by half a step's kick by its gradient, 2c h² [(δ·∂)F + ∂T/∂q(q, F)] with δ = M⁻¹F,
/// at both ends. The first term is a central difference; on the orbit it is that of the harmonics.
/// The reaction of the internal correction on the orbit, 1e-13 of the existing one, is neglected.
///
/// A kick by the gravity gradient changes the momenta of base and joints and the velocity of the
/// centre of mass. Its work on the internal motion, Δp·q'(p + Δp/2), and on the orbit are exact and
/// booked (ledgers.h).
///
/// A mechanism with loops is kicked along them: the loops take up the rest of each kick by impulses
/// that do no work. This is the exact flow of the kick's potential on the manifold. The corrector's
/// potential there is ½ Fᵀ M⁻¹ (F - Gᵀμ), μ the multipliers of M⁻¹F; its gradient has F - Gᵀμ in
/// the place of F, with μ held.
class SplitIntegrator final : public integrators::Integrator {
 public:
  /// The model must outlive it. @throws InvalidArgument for an unknown splitting or method, or a
  /// splitting with backward steps for a damped internal motion
  SplitIntegrator(const Spacecraft& model, double h, const SplitOptions& options = {});

  integrators::Outcome advance(double t, double h, State& state) override;
  void carry(Archive& archive) override;
  std::string remark() const override { return inner_->remark(); }
  bool integrates_power() const override { return true; }
  integrators::Cost cost() const override;
  void set_cost(const integrators::Cost& c) override;

  /// Why the last step failed, if the orbit is the reason: "below the surface at t = ... s".
  const std::string& trouble() const { return trouble_; }
  /// Opens the ledgers at a state unless they are open; otherwise the first step does so.
  void begin(const State& state);
  const SpaceLedgers& ledgers() const { return ledgers_; }

 private:
  SplitIntegrator(const integrators::OfRun& run, const Spacecraft& model, double h,
                  const SplitOptions& options);
  void gather(const State& s);
  void scatter(State& s) const;
  void pull(const OrbitPoint& p);
  /// middle: of the whole step, for parts that switch between steps.
  void kick(double t, double h, double middle, double correction, OrbitPoint& p);
  void correct(double weight, const OrbitPoint& p);
  /// Takes Bλ from momenta at q_, so that their rates keep the loops closed; λ in lambda_.
  void keep_loops(std::span<double> momenta, bool moving);
  /// Takes from the kick change_ what the loops take up; books what driven joints put in.
  void kick_along_loops();
  SpaceLedgers::Reading read(const OrbitPoint& p) const;
  Vec3<OrbitReal> angular_momentum() const;
  Vec3d impulse_of(std::span<const double> added) const;

  const Spacecraft& model_;
  const SplitScheme& scheme_;
  std::unique_ptr<const integrators::RunModel> internal_;  ///< null: the model's own
  std::unique_ptr<integrators::Integrator> inner_;
  GravityGradient<double> gradient_;
  OrbitPush push_;
  PlateForces plates_;
  bool has_plates_;
  std::vector<size_t> roots_;  ///< offsets in q of the base and of bodies that float beside it
  mechanics::Workspace<double> w_;
  size_t n_internal_, nq_;
  State inside_;
  std::vector<double> q_, change_, middle_, place_, turn_angles_;
  std::vector<double> extra_;  ///< besides the gradient: by the corrector and the plates
  std::vector<double> delta_, slope_, side_;         ///< for the corrector
  std::unique_ptr<phs::System<double>> linkage_;     ///< of the mechanism alone
  std::unique_ptr<phs::Constraints<double>> loops_;  ///< null: none
  std::vector<double> e_, lambda_, rows_, taken_, kicked_;
  SpaceLedgers ledgers_;
  std::string trouble_;
  std::vector<double> inner_before_;  ///< memory of the inner method before the step
};

}  // namespace porthos::space
