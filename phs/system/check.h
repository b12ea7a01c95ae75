#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "phs/system/system.h"

/// The axioms of the contract, checked by number on a user's own system.
namespace porthos::phs {

/// Where and how closely the axioms are looked at.
struct CheckOptions {
  int samples = 32;  ///< random states
  double spread =
      1.0;  ///< states are normal with this deviation; rotation blocks are unit quaternions
  double tolerance = 1e-11;  ///< relative to the sizes of the terms compared
  std::uint64_t seed = 1;
  /// The spread is times these, one for each number of the state and equal within a block: states
  /// of the system's own scale, where that is not 1 in its units (an orbit). Empty: 1.
  std::vector<double> sizes = {};
};

/// One axiom: the worst relative violation found and the state where it was found.
struct AxiomResult {
  /// "J skew", "R symmetric", "R >= 0", "canonical", "separable", "gradient", "efforts", "rate",
  /// "field", "storages", "power balance", "passive ...", "invariant ..."
  std::string axiom;
  double worst = 0;
  double limit = 0;
  std::vector<double> state;
  std::string why_not = {};  ///< why it could not be tried; empty: it was
  bool applies() const { return why_not.empty(); }
  bool holds() const { return !applies() || worst <= limit; }
};

/// What check() found, axiom by axiom.
struct CheckReport {
  std::vector<AxiomResult> axioms;
  bool holds() const;  ///< at least one axiom was tried, and every one that was holds
  /// One line per axiom; a violated one names the worst value, the limit and the state.
  std::string text() const;
};

/// Checks at random states: J skew, R symmetric and >= 0, J = [0 I; -I 0] and ∂²H/∂q∂p = 0 where
/// the traits say so, e = ∂H/∂x against forward duals, field = rate(e) + Gu with rate(e) = (J - R)e
/// where nothing else drives, the storages' sum against H, H' = yᵀu + supplied - dissipated, no
/// dissipated power below 0, and the declared invariants. A field that refuses to be evaluated
/// (InvalidArgument) leaves the axioms about it untried, with its reason. Cost: about 3·nx
/// evaluations per sample.
/// @throws InvalidArgument for sizes that are neither none nor nx
CheckReport check(const Model& model, const CheckOptions& options = {});

/// Why a system is not canonical or separable although its traits say so, found at a few random
/// states; nothing if they hold. For methods that rely on them: their order is lost where they do
/// not hold.
std::optional<std::string> false_trait(const Model& model);

}  // namespace porthos::phs
