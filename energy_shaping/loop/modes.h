#pragma once
#include <complex>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/closed_loop.h"

namespace porthos::energy_shaping {

/// A mode of a linearised loop: λ = -ζω ± iω √(1 - ζ²). A real eigenvalue is one of ζ = ±1.
struct Mode {
  double frequency;      ///< ω = |λ| [rad/s]
  double damping_ratio;  ///< ζ, below 0 where the mode grows
};

/// The slowest first, one for each conjugate pair. Eigenvalues of 0 are no modes.
/// @param eigenvalues  any number, conjugates included [1/s]
std::vector<Mode> modes(std::span<const std::complex<double>> eigenvalues);

/// Reports "modes": the slowest frequency, and each mode in words. Then "unstable": the damping
/// ratio of the mode that grows fastest, if one is below 0 by more than rounding. Else "hardly
/// damped": the least damping ratio, if it is below 0.01.
/// @param eigenvalues  as above
void report_modes(Certificate& certificate, std::span<const std::complex<double>> eigenvalues);

/// The same of a loop at its rest point, zeros apart.
void report_modes(Certificate& certificate, const ClosedLoop& loop);

/// The same after the condition that the "rightmost eigenvalue" is below -decay times the largest.
/// @param eigenvalues  by ascending real part, as phs::eigenvalues() gives them
/// @param of           what was linearised, for the certificate
void certify_modes(Certificate& certificate, std::span<const std::complex<double>> eigenvalues,
                   double decay, const std::string& of);

}  // namespace porthos::energy_shaping
