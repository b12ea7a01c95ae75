#include "energy_shaping/loop/derivatives.h"
#include "phs/scalars/derivative.h"

namespace porthos::energy_shaping {
namespace {

/// Column j of the derivative of f(x) → out by duals.
template <class F>
std::vector<double> by_duals(std::span<const double> x, F f) {
  const std::size_t n = x.size();
  std::vector<phs::Dual> s(x.begin(), x.end()), out(n);
  std::vector<double> J(n * n);
  phs::along_each(s, [&](std::size_t j) {
    f(s, out);
    for (std::size_t i = 0; i < n; ++i) J[i * n + j] = out[i].d;
  });
  return J;
}

}  // namespace

std::vector<double> field_jacobian(phs::System<phs::Dual>& s, std::span<const double> x) {
  return by_duals(x, [&](const auto& at, auto& out) { s.field(0.0, at, {}, out); });
}

std::vector<double> hessian(phs::System<phs::Dual>& s, std::span<const double> x) {
  return by_duals(x, [&](const auto& at, auto& out) { s.gradient(at, out); });
}

std::vector<double> field_jacobian(const phs::Model& model, std::span<const double> x) {
  return field_jacobian(*model.instantiate<phs::Dual>(), x);
}

std::vector<double> hessian(const phs::Model& model, std::span<const double> x) {
  return hessian(*model.instantiate<phs::Dual>(), x);
}

}  // namespace porthos::energy_shaping
