#pragma once
#include <atomic>

#include "integrators/derivatives/step_variation.h"

/// Tangents carried along a run by the derivative of its steps.
namespace porthos::integrators {

/// The derivative of a run's end by its start.
struct Monodromy {
  Outcome outcome = Outcome::ok;
  std::string remark;          ///< if not ok: where
  std::vector<double> matrix;  ///< ∂x_N/∂x_0, nx · nx, row by row
  phs::State end;              ///< the last state
};

/// ∂x_N/∂x_0 of `steps` steps h [s]: of a periodic orbit over one period the
/// monodromy matrix, whose eigenvalues are the multipliers. It is as symplectic as the steps are.
/// Cost: nx tangents, each about 7 fields at every stage.
/// @throws InvalidArgument as StepPieces and phs::linearise()
Monodromy monodromy(const std::string& method, const phs::Model& model, const phs::State& start,
                    double h, std::int64_t steps, const std::atomic<bool>* stop = nullptr);

/// How a spectrum is computed.
struct LyapunovOptions {
  int count = 0;            ///< the largest exponents that are wanted; 0: all nx
  std::int64_t settle = 0;  ///< steps before the first that counts: the tangents find their places
  int every = 1;            ///< steps from one orthonormalisation to the next
  const std::atomic<bool>* stop = nullptr;
};

/// Lyapunov exponents along a run.
struct LyapunovSpectrum {
  Outcome outcome = Outcome::ok;
  std::string remark;  ///< if not ok: where
  std::vector<double>
      exponents;  ///< in the order of the tangents, largest first where settled [1/s]
  /// The same over the second half: how far the two differ tells how far they have settled.
  std::vector<double> of_second_half;
  double time = 0;  ///< that they are means over [s]
  phs::State end;   ///< the last state
};

/// The Lyapunov exponents along a run: tangents carried by the derivative of the steps and made
/// orthonormal by QR, whose diagonal grows by them. All nx of a Hamiltonian system add up to zero
/// to rounding, those of a damped one to the mean of tr Df. The numbers are flat: each quaternion
/// with its momenta has two exponents that are zero, of |ξ|² and ξ·π. Exponents converge like 1/t.
/// Source: Benettin, Galgani, Giorgilli, Strelcyn 1980, Meccanica 15.
/// @throws InvalidArgument as monodromy(); for options out of range
LyapunovSpectrum lyapunov_spectrum(const std::string& method, const phs::Model& model,
                                   const phs::State& start, double h, std::int64_t steps,
                                   const LyapunovOptions& options = {});

}  // namespace porthos::integrators
