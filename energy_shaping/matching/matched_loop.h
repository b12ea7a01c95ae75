#pragma once
#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/matching/shaping.h"

namespace porthos::energy_shaping {

/// How closely the matching equations must hold, and where they are checked.
struct MatchingOptions {
  Region region;
  double matching =
      1e-10;  ///< bound of the relative residuals; 1e-6 is usual for numerical designs
  /// Throw if a condition fails. If off, the object is made in any case and its certificate says
  /// what fails, for negative controls and for examining a design.
  bool refuse = true;
};

/// Worst relative residual of the matching equations and its place.
struct MatchingResidual {
  double kinetic = 0, potential = 0;
};

/// A plant under interconnection and damping assignment: any canonical plant with H = ½ pᵀM(q)⁻¹p +
/// V(q), linear friction D and inputs p' += G(q) u; a MechanicalModel without quaternions, a
/// network with springs, a Plant of formulas.
///
///   u = (GᵀG)⁻¹Gᵀ (∂H/∂q - M_d M⁻¹ ∂H_d/∂q + J2 ∂H_d/∂p) - Kv Gᵀ ∂H_d/∂p
///
/// The plant's friction remains: (D M⁻¹M_d), which is neither symmetric nor >= 0 in general
/// (Gomez-Estern, van der Schaft 2004). Its symmetric part is added to G Kv Gᵀ in R_d, the skew
/// part to J_d.
///
/// Coordinates are not wrapped, because V_d need not be 2π-periodic. The ports are the actuated
/// ones, for an input v added to the law: y = Gᵀ ∂H_d/∂p, H_d' <= yᵀv.
///
/// The constructor checks the following over the region and refuses a failure with the reason and
/// the worst point: the plant's form, M_d > 0, the matching equations, the rest point and the
/// Hessian of V_d, Kv and the damping with the plant's friction. Cost of a field: n + 1 gradients
/// of the plant and n + 1 evaluations of the design (more with Skew::solved).
class MatchedLoop : public ClosedLoopFor<MatchedLoop> {
 public:
  MatchedLoop(std::shared_ptr<const phs::Model> plant, std::shared_ptr<const Shaping> shaping,
              const std::vector<std::string>& actuated_ports, std::vector<double> rest_coordinates,
              MatchingOptions options);

  const phs::Description& description() const override { return description_; }
  std::vector<std::string> gain_names() const override;
  std::string hindrance(std::span<const double> x) const override {
    return shaping_->hindrance(x.first(size_t(shaping_->size())));
  }
  const Shaping& shaping() const { return *shaping_; }
  const MatchingOptions& options() const { return options_; }

  /// Relative residuals at one state.
  MatchingResidual residual(std::span<const double> x) const;
  /// p = M(q) v.
  std::vector<double> state(std::span<const double> q, std::span<const double> v) const;

  template <class T>
  std::unique_ptr<LoopSystem<T>> make_loop() const;

 private:
  void check();

  std::shared_ptr<const Shaping> shaping_;
  MatchingOptions options_;
  phs::Description description_;
};

}  // namespace porthos::energy_shaping
