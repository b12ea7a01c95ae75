#pragma once
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "phs/scalars/scalar.h"

/// Elastic energies of actuators
///
///   E(q, θ, σ)     q link angle, θ the motor's equilibrium angle, σ the stiffness setting
///
/// One function gives all effects of an actuator on its surroundings: the torque on the link
/// -∂E/∂q, the torque on the motor -∂E/∂θ, the effort at its stiffness port ∂E/∂σ, and the
/// stiffness ∂²E/∂q². A model that derives them from one energy cannot generate energy, whatever
/// moves q, θ and σ (Visser, Carloni, Stramigioli 2010, ICRA).
namespace porthos::vsa {

/// ∂E/∂(q, θ, σ): [N m, N m, N m per unit of σ]. These are the efforts that a motion has to supply;
/// the spring exerts their negatives.
template <class T>
struct Slopes {
  T q, theta, sigma;
};

/// Limits of deflection and σ. Beyond them a stop also stores energy, ⅓ stiffness · depth³: E is C²
/// there, and nothing is clipped. Each family defines the quantity that its deflection limit
/// applies to (one per spring if there are several).
struct Limits {
  double deflection = HUGE_VAL;  ///< [rad], > 0
  double stop_stiffness = 0;     ///< [N m/rad²] where deflection is given, > 0
  double sigma_lower = -HUGE_VAL, sigma_upper = HUGE_VAL;  ///< unit of σ
  double sigma_stop_stiffness = 0;  ///< [J/σ³]; 0: the range of σ holds at the start only
};

/// The description of an elastic energy.
struct ElasticTraits {
  std::string family;  ///< "cosh", "maccepa", ...
  std::string title;   ///< one line for readers
  /// the meaning of σ: "half the angle between the motors"; empty: the energy does not depend on σ
  std::string sigma;
  std::string sigma_unit;  ///< "rad", "m", "1"
  std::string sigma_rate_unit() const { return sigma_unit == "1" ? "1/s" : sigma_unit + "/s"; }
  /// Of what changes σ, so that rate and effort make W.
  std::string sigma_effort_unit() const {
    return sigma_unit == "rad" ? "N m" : sigma_unit == "m" ? "N" : "J";
  }
  bool translation_invariant = true;  ///< E depends only on q - θ: ∂E/∂q = -∂E/∂θ to the bit
  Limits limits;
  /// The deflections that were measured; outside of them the energy is extrapolated [rad].
  double measured_from = -HUGE_VAL, measured_to = HUGE_VAL;
  std::string remark = {};  ///< what costs its users accuracy, a sentence; empty: nothing known
  /// Where the third derivative of a formula by φ jumps most, as of |φ|³ at 0: steps over this
  /// deflection lose their order [rad]. NaN: nowhere, or another energy.
  double kink = NAN;
};

/// One energy with its derivatives in every scalar. Immutable, shared between threads. No
/// evaluation allocates.
class Elastic {
 public:
  virtual ~Elastic() = default;
  const ElasticTraits& traits() const { return traits_; }

#define PORTHOS_ELASTIC(T)                                                \
  virtual T energy(const T& q, const T& theta, const T& sigma) const = 0; \
  virtual Slopes<T> slopes(const T& q, const T& theta, const T& sigma) const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_ELASTIC)
#undef PORTHOS_ELASTIC

  /// The second derivatives, with rows and columns (q, θ, σ), by differentiating twice. [0][0] is
  /// the stiffness [N m/rad].
  using Hessian = std::array<std::array<double, 3>, 3>;
  virtual Hessian hessian(double q, double theta, double sigma) const = 0;
  double stiffness(double q, double theta, double sigma) const {
    return hessian(q, theta, sigma)[0][0];
  }
  /// The deflections that the limit applies to, at these angles. Empty if there is no limit.
  virtual std::vector<double> strains(double q, double theta, double sigma) const = 0;

  /// @throws InvalidArgument for a start with a deflection beyond its limit, σ out of its range, or
  /// a number that is not finite. `who` begins the text.
  void require_inside(const std::string& who, double q, double theta, double sigma) const;

 protected:
  explicit Elastic(ElasticTraits t) : traits_(std::move(t)) {}
  ElasticTraits traits_;
};
using ElasticPtr = std::shared_ptr<const Elastic>;

}  // namespace porthos::vsa
