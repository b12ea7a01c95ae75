#pragma once
#include <span>
#include <vector>

#include "energy_shaping/loop/closed_loop.h"

/// Derivatives for the certificates, by dual numbers. Not for kernels.
namespace porthos::energy_shaping {

/// The Jacobian of the closed loop's field at x, row by row, exact.
std::vector<double> field_jacobian(const phs::Model& model, std::span<const double> x);
/// The Hessian of H_d at x, row by row, exact.
std::vector<double> hessian(const phs::Model& model, std::span<const double> x);

/// The same of an evaluator at x, as of a loop with gains of its own.
std::vector<double> field_jacobian(phs::System<phs::Dual>& system, std::span<const double> x);
/// The same of an evaluator at x.
std::vector<double> hessian(phs::System<phs::Dual>& system, std::span<const double> x);

}  // namespace porthos::energy_shaping
