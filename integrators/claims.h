#pragma once
#include <string>
#include <vector>

#include "integrators/core/integrator.h"

/// What a method declares, measured on a system: for methods of a program's own, and for those of
/// the catalogue, which the tests hold to it.
namespace porthos::integrators {

/// The directions in which x can move, as vectors of nx numbers: of a rotation block those that
/// keep |ξ| = 1 and ξ·π = 0, and with constraints those along them. x = (q, p).
std::vector<std::vector<double>> tangents(const phs::Model& model, const std::vector<double>& x);

/// |Ψuᵀ J Ψv - uᵀ J v| over |Ψu| |Ψv|, the largest over pairs of tangents u, v; images[i] = Ψ
/// tangents[i].
double symplectic_defect(const std::vector<std::vector<double>>& tangents,
                         const std::vector<std::vector<double>>& images);

/// The defect of the exact Jacobian of steps: dual numbers carry tangents through the very code
/// that steps a run, iteration included.
struct SymplecticDefect {
  double worst = 0;
  int failed = 0;     ///< tangents whose steps did not end: difference quotients have no derivative
  double growth = 0;  ///< the largest number of an image
};
/// Of two steps of h [s]. @throws InvalidArgument as make_basic_integrator
SymplecticDefect symplectic_defect(const std::string& method, const phs::Model& model,
                                   const std::vector<double>& start,
                                   const std::vector<std::vector<double>>& tangents, double h);

/// The largest |a - b| / (1 + |b|) of a state after 20 steps of h [s] forth and 20 back, against
/// the start; NaN if a step fails. For autonomous systems.
double symmetry_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                       double h);

/// The largest changes of linear and of quadratic invariants in 300 steps, over their size at the
/// start, or over 1 if that is less: of steps h [s], and of 4 h where they converge. NaN if a step
/// h fails before a change shows.
struct InvariantDefect {
  double linear = 0, quadratic = 0;
};
InvariantDefect invariant_defect(const std::string& method, const phs::Model& model,
                                 const phs::State& start, double h);

/// The largest change of H, less the works of the system's powers as the method integrates them,
/// within 100 steps of h [s], and of 3 h and 6 h, as far as they converge: over |H| at the start
/// and the sum of all |works|. NaN if a step h fails before a change shows.
double energy_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                     double h);

/// The order of the error after 4 h [s], from steps 4 h, 2 h, h, ... that are compared with each
/// other, in 113 bits where the method has them. NaN if too few steps converge.
struct MeasuredOrder {
  double order;
  double coarse = 0, fine = 0;  ///< the steps between whose errors it was found [s]
  bool exact = false;           ///< the errors are no more than rounding; then order is NaN
};
MeasuredOrder measured_order(const std::string& method, const phs::Model& model,
                             const phs::State& start, double h);

/// The largest |a - b| / (1 + |b|) of a state after 20 steps of h [s] that were taken up again,
/// with the method's memory, after the tenth; 0 if it is resumable. NaN if a step fails.
double restart_defect(const std::string& method, const phs::Model& model, const phs::State& start,
                      double h);

/// One claim of a method, as it shows on a system.
struct ClaimResult {
  /// "order", "symmetric", "symplectic", "quadratic invariants", "energy", "passivity", "resumable"
  std::string claim;
  bool declared = true;      ///< whether the method claims it
  double measured = 0;       ///< the error; of the order, the order
  double bound = 0;          ///< the largest error, the smallest order of what holds
  std::string why_not = {};  ///< why it could not be measured; empty if it was
  std::string how = {};      ///< what was compared: "after 20 steps forth and 20 back"
  /// Whether what is declared shows, or cannot be measured on such a system. False where the steps
  /// break down.
  bool holds() const;
};

/// What check_claims() found.
struct ClaimReport {
  std::string method, system;
  double step = 0;  ///< [s]
  std::vector<ClaimResult> claims;
  bool holds() const;  ///< all declared claims do
  /// One line for each claim: declared, measured, bound, verdict. A sentence for each that fails.
  std::string text() const;
};

/// Measures the claims of any method of the catalogue, also of one that was added, from `start`
/// with steps of h [s]. Take a step as long as runs have: the errors of a false claim shrink with
/// it. Symmetry and symplecticity are measured with 3 h and 6 h too, as far as these resolve the
/// motion to 1 %; where their errors are too small for a false claim to show, that is told. A claim
/// that holds here need not hold on every system. Methods whose error a tolerance sets take steps
/// with a loose one, 1e-5, which would show a false claim.
/// @throws InvalidArgument as make_integrator, and for a start of another size
ClaimReport check_claims(const std::string& method, const phs::Model& model,
                         const std::vector<double>& start, double h);

}  // namespace porthos::integrators
