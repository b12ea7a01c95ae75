#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "phs/system/system.h"

/// Numerical checks of the contract's axioms on a user's own system.
namespace porthos::phs {

/// Sampling and tolerance of check().
struct CheckOptions {
  int samples = 32;  ///< random states
  double spread =
      1.0;  ///< states are normal with this deviation; rotation blocks are unit quaternions
  double tolerance = 1e-11;  ///< relative to the sizes of the terms compared
  std::uint64_t seed = 1;
  /// Scale factors of the spread, one per number of the state and equal within a block. They give
  /// states of the system's own scale where its units do not make that 1 (an orbit). Empty: 1.
  std::vector<double> sizes = {};
};

/// One axiom: the worst relative violation found and the state where it was found.
struct AxiomResult {
  /// "J skew", "R symmetric", "R >= 0", "canonical", "separable", "quadratic", "gradient",
  /// "efforts", "rate", "field", "storages", "power balance", "passive ...", "invariant ..."
  std::string axiom;
  double worst = 0;
  double limit = 0;
  std::vector<double> state;
  std::string why_not = {};  ///< why it could not be checked; empty if it was
  bool applies() const { return why_not.empty(); }
  bool holds() const { return !applies() || worst <= limit; }
};

/// The result of check(), axiom by axiom.
struct CheckReport {
  std::vector<AxiomResult> axioms;
  bool holds() const;  ///< at least one axiom was checked, and all that were checked hold
  /// One line per axiom; the line of a violated one has the worst value, the limit and the state.
  std::string text() const;
};

/// Checks at random states: J skew; R symmetric and >= 0; J = [0 I; -I 0] and ∂²H/∂q∂p = 0 where
/// the traits claim it; e = ∂H/∂x against forward duals; field = rate(e) + Gu; rate(e) = (J - R)e
/// where no sources act; the sum of the storages against H; H' = yᵀu + supplied - dissipated; no
/// dissipated power below 0; and the declared invariants. If the field throws InvalidArgument, its
/// axioms stay unchecked and the report gives the reason. Cost: about 3·nx evaluations per sample.
/// @throws InvalidArgument if sizes is neither empty nor of size nx
CheckReport check(const Model& model, const CheckOptions& options = {});

/// Why a system that claims to be canonical or separable is not, checked at a few random states;
/// nothing if both claims hold. Methods that rely on these traits lose their order where they are
/// false.
std::optional<std::string> false_trait(const Model& model);

/// Why a system that claims that H has at most degree two in its momenta is wrong, likewise. Only
/// the gradient of a RateTimeScale relies on that.
std::optional<std::string> falsely_quadratic(const Model& model);

}  // namespace porthos::phs
