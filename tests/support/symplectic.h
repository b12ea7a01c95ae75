#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "integrators/claims.h"

/// Whether a step is a symplectic map, by its exact Jacobian.
namespace porthos::test {

/// ‖ΨᵀJΨ - J‖∞, with Ψ row-major, x = (q, p).
inline double symplectic_defect(const std::vector<double>& Psi, size_t n) {
  double worst = 0;
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) {
      double sum = i + n / 2 == j ? -1.0 : j + n / 2 == i ? 1.0 : 0.0;
      for (size_t k = 0; k < n / 2; ++k)
        sum +=
            Psi[k * n + i] * Psi[(k + n / 2) * n + j] - Psi[(k + n / 2) * n + i] * Psi[k * n + j];
      worst = std::max(worst, std::fabs(sum));
    }
  return worst;
}

/// The Jacobian of two steps of a method, exact to rounding: a dual number carries one column
/// through the very code that steps a run, iteration included.
inline std::vector<double> jacobian_of_steps(const std::string& method, const phs::Model& model,
                                             const std::vector<double>& x0, double h) {
  const size_t n = x0.size();
  std::vector<double> Psi(n * n);
  for (size_t j = 0; j < n; ++j) {
    phs::BasicState<phs::Dual> s(model.description(), {x0.begin(), x0.end()});
    s.x[j].d = 1;
    const auto integrator = integrators::make_basic_integrator<phs::Dual>(method, model, h);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(integrator->step(s), integrators::Outcome::ok) << method;
    for (size_t i = 0; i < n; ++i) Psi[i * n + j] = s.x[i].d + s.lo[i].d;
  }
  return Psi;
}

using integrators::symplectic_defect;

/// That of a method's steps. A method that claims to be symplectic must converge.
inline double symplectic_defect(const std::string& method, const phs::Model& model,
                                const std::vector<double>& start,
                                const std::vector<std::vector<double>>& tangents, double h,
                                bool must_converge) {
  const auto defect = symplectic_defect(method, model, start, tangents, h);
  EXPECT_TRUE(!defect.failed || !must_converge) << method;
  return defect.worst;
}

}  // namespace porthos::test
