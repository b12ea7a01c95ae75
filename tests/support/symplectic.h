#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"

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

inline double dot_J(const std::vector<double>& a, const std::vector<double>& b) {
  const size_t n = a.size() / 2;
  double sum = 0;
  for (size_t k = 0; k < n; ++k) sum += a[k] * b[n + k] - a[n + k] * b[k];
  return sum;
}

/// |Ψuᵀ J Ψv - uᵀ J v| over |Ψu| |Ψv|, the largest over pairs of tangents; images[i] = Ψ
/// tangents[i].
inline double symplectic_defect(const std::vector<std::vector<double>>& tangents,
                                const std::vector<std::vector<double>>& images) {
  const auto norm = [](const std::vector<double>& a) {
    double sum = 0;
    for (double x : a) sum += x * x;
    return std::sqrt(sum);
  };
  double worst = 0;
  for (size_t i = 0; i < images.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const double d = dot_J(images[i], images[j]) - dot_J(tangents[i], tangents[j]);
      const double relative = std::fabs(d) / std::max(1.0, norm(images[i]) * norm(images[j]));
      worst = !(relative <= worst) ? relative : worst;
    }
  return worst;
}

/// The exact Jacobian Ψ of two steps, applied to tangents: a dual number carries a tangent through
/// the very code that steps a run, iteration included.
inline double symplectic_defect(const std::string& method, const phs::Model& model,
                                const std::vector<double>& start,
                                const std::vector<std::vector<double>>& tangents, double h,
                                bool must_converge) {
  std::vector<std::vector<double>> images, moved;
  for (const auto& u : tangents) {
    phs::BasicState<phs::Dual> s(model.description(), {start.begin(), start.end()});
    for (size_t i = 0; i < u.size(); ++i) s.x[i].d = u[i];
    const auto integrator = integrators::make_basic_integrator<phs::Dual>(method, model, h);
    bool ok = true;
    for (int i = 0; i < 2; ++i) ok = ok && integrator->step(s) == integrators::Outcome::ok;
    EXPECT_TRUE(ok || !must_converge) << method;
    if (!ok) continue;  // difference quotients have no derivative to speak of
    std::vector<double> image;
    for (size_t i = 0; i < u.size(); ++i) image.push_back(s.x[i].d + s.lo[i].d);
    images.push_back(image);
    moved.push_back(u);
  }
  return symplectic_defect(moved, images);
}

}  // namespace porthos::test
